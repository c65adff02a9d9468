//! Owns the picture of a lattice: its sites as spheres, over and through the bone, of the whole specimen and of a part of it.

use super::body::Body;
use super::camera::Camera;
use super::edges;
use super::paint::{Light, Plain, linear};
use super::panel::{self, Panel};
use super::vec3::{Vec3, dot};
use crate::draw::ink::{self, PAPER};
use crate::grid::Grid;
use crate::volume::Volume;
use image::{Rgb, RgbImage};
use rayon::prelude::*;

/// Pixels of the longer side of a panel.
const SIDE: f32 = 480.0;
const GAP: u32 = 40;
const MARGIN: u32 = 24;
/// Under each row of panels, for its names and bars.
const FOOT: u32 = 92;
const TEXT: f32 = 20.0;
/// Lattice parameters a side of the part.
const PART: f64 = 8.0;
/// Radius of a sphere, in lattice parameters.
const RADIUS: f64 = 0.24;
/// How much of a site is seen through bone.
const THROUGH: f32 = 0.5;

/// Sites of one lattice.
pub struct ShownLattice<'a> {
    /// As `firm, SC, LP 0.12 mm`.
    pub name: String,
    /// The lattice parameter.
    pub lp_mm: f64,
    /// Sites of one colour, each with what they are, as `fully coordinated`.
    pub kinds: Vec<Kind<'a>>,
}

/// Sites of one colour.
pub struct Kind<'a> {
    /// What they are.
    pub name: &'a str,
    /// Their colour.
    pub colour: SiteColour,
    /// From the corner of the specimen.
    pub at_mm: Vec<[f64; 3]>,
}

/// As in Figure 2 of Zojaji et al. (2024), in the colours of Okabe and Ito.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SiteColour {
    /// Firm, with all bonds.
    Red,
    /// Firm, beyond them.
    Blue,
    /// Floppy.
    Green,
}

impl SiteColour {
    fn rgb(self) -> Rgb<u8> {
        Rgb(match self {
            SiteColour::Red => [213, 60, 20],
            SiteColour::Blue => [30, 110, 190],
            SiteColour::Green => [0, 158, 95],
        })
    }
}

/// Each lattice in a row: the whole specimen, then a part of it.
pub fn lattices(bone: &Volume<u8>, shown: &[ShownLattice]) -> RgbImage {
    let part = shown.first().map(|lattice| part(bone, lattice.lp_mm));
    let views: Vec<View> = std::iter::once(View::new(bone.clone(), [0.0; 3]))
        .chain(part.map(|(bone, corner)| View::new(bone, corner)))
        .collect();
    let sizes: Vec<[u32; 2]> = views.iter().map(|view| view.camera.size).collect();
    let height = sizes.iter().map(|s| s[1]).max().unwrap_or(0) + FOOT;
    let width = sizes.iter().map(|s| s[0] + GAP).sum::<u32>() + 2 * MARGIN - GAP;
    let mut picture = RgbImage::from_pixel(width, MARGIN + height * shown.len() as u32, PAPER);
    for (row, lattice) in shown.iter().enumerate() {
        let (mut left, top) = (MARGIN, MARGIN + height * row as u32);
        let foot = (top + height - FOOT) as f32;
        for view in &views {
            let panel = view.with(lattice);
            let corner = [left, top + (height - FOOT - panel.size[1]) / 2];
            panel.put(&mut picture, corner);
            edges::draw(
                &mut picture,
                &panel,
                &view.camera,
                view.bone.grid.size_mm(),
                corner,
            );
            let bar = [(left + panel.size[0]) as f32 - SIDE / 4.0, foot + 24.0];
            ink::scale_bar(
                &mut picture,
                bar,
                f64::from(view.camera.per_mm),
                f64::from(SIDE) / 5.0,
                TEXT,
            );
            left += panel.size[0] + GAP;
        }
        legend(&mut picture, lattice, [MARGIN as f32, foot + 24.0]);
    }
    picture
}

/// A cube of [`PART`] lattice parameters, and its corner: of nine along each axis, the one whose bone fraction is nearest to a third.
fn part(bone: &Volume<u8>, lp_mm: f64) -> (Volume<u8>, [f64; 3]) {
    let grid = bone.grid;
    let side: [usize; 3] = std::array::from_fn(|a| {
        ((PART * lp_mm / grid.spacing_mm[a]).round() as usize).clamp(1, grid.n[a])
    });
    let places = |a: usize| (1..=9).map(move |k| (grid.n[a] - side[a]) * k / 10);
    let all = bone.as_slice();
    let rows = |[x, y, z]: [usize; 3]| {
        let rows = (z..z + side[2])
            .flat_map(move |z| (y..y + side[1]).map(move |y| grid.index([x, y, z])));
        rows.map(move |row| &all[row..row + side[0]])
    };
    let count = |at| rows(at).flatten().filter(|&&b| b != 0).count();
    let wanted = side.iter().product::<usize>() / 3;
    let corners =
        places(2).flat_map(|z| places(1).flat_map(move |y| places(0).map(move |x| [x, y, z])));
    let corners: Vec<[usize; 3]> = corners.collect();
    let best = corners
        .into_par_iter()
        .min_by_key(|&at| (count(at).abs_diff(wanted), at))
        .unwrap_or([0; 3]);
    let cut: Vec<u8> = rows(best).flatten().copied().collect();
    let corner = std::array::from_fn(|a| best[a] as f64 * grid.spacing_mm[a]);
    (
        Volume::from_vec(Grid::new(side, grid.spacing_mm), cut),
        corner,
    )
}

/// Bone that is drawn once for all lattices.
struct View {
    bone: Volume<u8>,
    corner_mm: [f64; 3],
    camera: Camera,
    panel: Panel,
}

impl View {
    fn new(bone: Volume<u8>, corner_mm: [f64; 3]) -> View {
        let camera = Camera::new(bone.grid.size_mm(), SIDE);
        let panel = panel::panel(&Body::new(&bone), &camera, &Plain);
        View {
            bone,
            corner_mm,
            camera,
            panel,
        }
    }

    /// The bone with the sites before it, and with those that it hides half seen.
    fn with(&self, lattice: &ShownLattice) -> Panel {
        let radius = (RADIUS * lattice.lp_mm) as f32;
        let size = self.bone.grid.size_mm();
        let mut spheres: Vec<([f32; 2], f32, Light)> = Vec::new();
        for kind in &lattice.kinds {
            let colour = linear(kind.colour.rgb());
            for at in &kind.at_mm {
                let at: [f64; 3] = std::array::from_fn(|a| at[a] - self.corner_mm[a]);
                // Padding goes on beyond the scan; the picture does not.
                if (0..3).all(|a| (-1e-9..=size[a] + 1e-9).contains(&at[a])) {
                    let (place, depth) = self.camera.seen(at.map(|c| c as f32));
                    spheres.push((place, depth, colour));
                }
            }
        }
        let width = self.panel.size[0] as usize;
        let reach = radius * self.camera.per_mm;
        let mut rows: Vec<Vec<usize>> = vec![Vec::new(); self.panel.size[1] as usize];
        for (i, (place, _, _)) in spheres.iter().enumerate() {
            let [from, to] = [place[1] - reach, place[1] + reach].map(|y| y.max(0.0) as usize);
            rows.iter_mut()
                .take(to + 1)
                .skip(from)
                .for_each(|row| row.push(i));
        }
        let light = rows.par_iter().enumerate().flat_map_iter(|(y, row)| {
            let bone = y * width..(y + 1) * width;
            let near = row.iter().map(|&i| &spheres[i]);
            self.row(
                y,
                near,
                radius,
                &self.panel.light[bone.clone()],
                &self.panel.depth[bone],
            )
        });
        Panel {
            size: self.panel.size,
            light: light.collect(),
            depth: self.panel.depth.clone(),
        }
    }

    /// One row of pixels.
    fn row<'s>(
        &self,
        y: usize,
        spheres: impl Iterator<Item = &'s ([f32; 2], f32, Light)>,
        radius: f32,
        bone: &[Light],
        depth: &[f32],
    ) -> Vec<Light> {
        let per_mm = self.camera.per_mm;
        let mut nearest: Vec<Option<(f32, Vec3, Light)>> = vec![None; bone.len()];
        for (place, middle, colour) in spheres {
            let off_y = (y as f32 + 0.5 - place[1]) / per_mm;
            let half = (radius * radius - off_y * off_y).max(0.0).sqrt() * per_mm;
            let from = (place[0] - half).max(0.0) as usize;
            let to = ((place[0] + half).max(0.0) as usize + 1).min(bone.len());
            let reached = nearest.iter_mut().enumerate().take(to).skip(from);
            for (x, nearest) in reached {
                let off_x = (x as f32 + 0.5 - place[0]) / per_mm;
                let squared = radius * radius - off_x * off_x - off_y * off_y;
                if squared > 0.0 {
                    let high = squared.sqrt();
                    let depth = middle - high;
                    if nearest.is_none_or(|(known, ..)| depth < known) {
                        *nearest = Some((
                            depth,
                            [off_x / radius, -off_y / radius, high / radius],
                            *colour,
                        ));
                    }
                }
            }
        }
        let pixels = nearest.iter().zip(bone).zip(depth);
        pixels
            .map(|((sphere, bone), depth)| over(*bone, *depth, sphere))
            .collect()
    }
}

/// A pixel of bone and the nearest sphere there.
fn over(bone: Light, bone_depth: f32, sphere: &Option<(f32, Vec3, Light)>) -> Light {
    let pale = if bone_depth.is_finite() {
        bone.map(|c| 0.75 * c + 0.25)
    } else {
        bone
    };
    let Some((depth, normal, colour)) = sphere else {
        return pale;
    };
    let key = dot(*normal, [-0.55, 0.62, 0.56]).max(0.0);
    let lit = colour.map(|c| c * (0.45 + 0.65 * key) + 0.25 * key.powi(24));
    match *depth < bone_depth {
        true => lit,
        false => std::array::from_fn(|c| THROUGH * lit[c] + (1.0 - THROUGH) * pale[c]),
    }
}

/// The lattice's name, and what its colours are.
fn legend(picture: &mut RgbImage, lattice: &ShownLattice, [left, y]: [f32; 2]) {
    ink::write(picture, [left, y], TEXT, &lattice.name);
    let mut x = left;
    for kind in &lattice.kinds {
        ink::line(
            picture,
            [[x + 8.0, y + 27.0], [x + 8.0, y + 27.0]],
            15.0,
            kind.colour.rgb(),
            |_, _| true,
        );
        let text = format!("{} {}", kind.at_mm.len(), kind.name);
        ink::write(picture, [x + 22.0, y + 34.0], TEXT, &text);
        x += 46.0 + ink::width(&text, TEXT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_site_before_the_bone_hides_it_and_one_within_is_half_seen() {
        let grid = Grid::new([20; 3], [0.1; 3]);
        let mask = (0..grid.len()).map(|i| u8::from(i % 20 < 10)).collect();
        let view = View::new(Volume::from_vec(grid, mask), [0.0; 3]);
        let at = |site: [f64; 3]| {
            let kinds = vec![Kind {
                name: "sites",
                colour: SiteColour::Blue,
                at_mm: vec![site],
            }];
            let panel = view.with(&ShownLattice {
                name: String::new(),
                lp_mm: 0.5,
                kinds,
            });
            let ([x, y], _) = view.camera.seen(site.map(|c| c as f32));
            panel.light[x as usize + panel.size[0] as usize * y as usize]
        };
        let [before, within] = [at([1.4, 1.0, 1.0]), at([0.5, 1.0, 1.0])];
        let blue = |light: Light| light[2] - light[0];
        assert!(
            blue(before) > 1.5 * blue(within) && blue(within) > 0.05,
            "{before:?} {within:?}"
        );
        // Beyond the scan nothing is drawn.
        assert!(blue(at([2.1, 1.0, 1.0])) <= 0.0);
    }
}
