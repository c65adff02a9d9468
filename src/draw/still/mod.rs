//! Owns stills: a specimen in three dimensions, in light and shadow, with a scale bar and its load axis; plain, coloured by a
//! field, or with the sites of a lattice.

mod body;
mod camera;
mod edges;
mod labels;
mod paint;
mod panel;
mod ray;
pub mod sites;
mod vec3;

use crate::draw::colour_bar::Coloured;
use crate::grid::Axis;
use crate::volume::Volume;
use body::Body;
use camera::Camera;
use image::RgbImage;
use paint::{Painted, Plain};

/// Pixels of a specimen's longer side.
const SIDE: f32 = 640.0;

/// The bone, plain.
pub fn bone(bone: &Volume<u8>, load: Axis) -> RgbImage {
    let camera = Camera::new(bone.grid.size_mm(), SIDE);
    let body = Body::new(bone);
    let panel = panel::panel(&body, &camera, &Plain);
    labels::page(&panel, &camera, bone.grid.size_mm(), load, None)
}

/// The bone with the colours of a field.
pub fn field(bone: &Volume<u8>, field: &Coloured, load: Axis) -> RgbImage {
    let camera = Camera::new(bone.grid.size_mm(), SIDE);
    let body = Body::new(bone);
    let paint = Painted {
        field,
        factor: body.factor as f32,
    };
    let panel = panel::panel(&body, &camera, &paint);
    labels::page(&panel, &camera, bone.grid.size_mm(), load, Some(field))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::ink::PAPER;
    use crate::draw::map::Range;
    use crate::grid::Grid;

    /// `n` voxels a side, bone where `is_bone`.
    fn body(n: usize, is_bone: impl Fn([usize; 3]) -> bool) -> Volume<u8> {
        let grid = Grid::new([n; 3], [0.05; 3]);
        let at = |i: usize| [i % n, i / n % n, i / (n * n)];
        Volume::from_vec(
            grid,
            (0..grid.len()).map(|i| u8::from(is_bone(at(i)))).collect(),
        )
    }

    fn cube() -> Volume<u8> {
        body(40, |at| at.iter().all(|c| (10..30).contains(c)))
    }

    /// Lightness of the panel at a place of the specimen, mm.
    fn lightness(panel: &panel::Panel, camera: &Camera, at_mm: [f32; 3]) -> f32 {
        let ([x, y], _) = camera.seen(at_mm);
        panel.light[x as usize + panel.size[0] as usize * y as usize]
            .iter()
            .sum::<f32>()
            / 3.0
    }

    #[test]
    fn the_faces_of_a_cube_are_lit_from_above_and_from_the_left() {
        let bone = cube();
        let camera = Camera::new(bone.grid.size_mm(), 200.0);
        let panel = panel::panel(&Body::new(&bone), &camera, &Plain);
        // Middles of the faces that are seen: the upper, that towards -y (left in the picture), that towards +x (right).
        let [top, left, right] = [[1.0, 1.0, 1.5], [1.0, 0.5, 1.0], [1.5, 1.0, 1.0]]
            .map(|at| lightness(&panel, &camera, at));
        assert!(
            top > left + 0.1 && left > right + 0.1 && right > 0.1,
            "{top} {left} {right}"
        );
        // Between the cube and the edge of the box is paper.
        assert_eq!(lightness(&panel, &camera, [0.05, 0.05, 1.95]), 1.0);
    }

    #[test]
    fn a_strut_of_one_voxel_is_seen_all_along() {
        let bone = body(40, |[x, y, _]| x == 20 && y == 20);
        let camera = Camera::new(bone.grid.size_mm(), 400.0);
        let panel = panel::panel(&Body::new(&bone), &camera, &Plain);
        for z in 0..39 {
            let at = lightness(&panel, &camera, [1.025, 1.025, 0.025 + 0.05 * z as f32]);
            assert!(at < 0.95, "{z}: {at}");
        }
    }

    #[test]
    fn a_picture_is_the_same_on_any_number_of_threads() {
        let bone = body(24, |[x, y, z]| (x * x + 3 * y * z) % 7 < 3);
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| super::bone(&bone, Axis::Z))
        };
        let one = on(1);
        assert!(one.pixels().filter(|p| p.0 != PAPER.0).count() > 50_000);
        assert!(one == on(3));
    }

    #[test]
    fn a_field_is_seen_in_its_colours() {
        let bone = cube();
        let values = bone.as_slice().iter().enumerate();
        let values: Vec<f32> = values
            .map(|(i, &b)| f32::from(b) * if i / 1600 < 20 { 1.0 } else { 2.0 })
            .collect();
        let values = Volume::from_vec(bone.grid, values);
        let range = Range {
            low: 1.0,
            high: 2.0,
        };
        let field = Coloured {
            values: &values,
            name: "value",
            range,
        };
        let camera = Camera::new(bone.grid.size_mm(), 200.0);
        let paint = Painted {
            field: &field,
            factor: 1.0,
        };
        let panel = panel::panel(&Body::new(&bone), &camera, &paint);
        // Viridis: low values are more blue than green, high ones more green than blue.
        let at = |z: f32| {
            let ([x, y], _) = camera.seen([1.0, 0.5, z]);
            panel.light[x as usize + panel.size[0] as usize * y as usize]
        };
        assert!(
            at(0.7)[2] > at(0.7)[1] && at(1.3)[1] > at(1.3)[2],
            "{:?} {:?}",
            at(0.7),
            at(1.3)
        );
    }
}
