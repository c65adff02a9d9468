//! Owns the scan of a phantom: debris, blur, noise.

use super::waves::Numbers;
use super::{Phantom, PhantomParams};
use crate::mask::gaussian;
use crate::volume::Volume;

pub fn scan(phantom: &mut Phantom, params: &PhantomParams) -> Volume<i16> {
    let grid = phantom.mask.grid;
    let [dark, contrast] = [params.background_hu, params.bone_hu - params.background_hu];
    let mut bone = Volume::from_vec(
        grid,
        phantom
            .mask
            .as_slice()
            .iter()
            .map(|&v| f32::from(v))
            .collect(),
    );
    phantom.summary.debris = add_debris(&mut bone, &phantom.mask, params);
    let noise = Numbers::new(params.seed, 3);
    let plane = grid.n[0] * grid.n[1];
    let slabs = gaussian::map_slabs(
        &bone,
        params.blur_voxels,
        |v| v,
        |slices, values| {
            let first = (slices.start * plane) as u64;
            let grey = |(at, &v): (usize, &f32)| {
                let hu = dark
                    + contrast * f64::from(v)
                    + params.noise_hu * noise.normal(first + at as u64);
                hu.round() as i16
            };
            values.iter().enumerate().map(grey).collect::<Vec<i16>>()
        },
    );
    Volume::from_vec(grid, slabs.concat())
}

/// Balls of 1 to 2.5 voxels' radius that stay two voxels clear of the bone. Returns how many found room.
fn add_debris(bone: &mut Volume<f32>, mask: &Volume<u8>, params: &PhantomParams) -> u64 {
    let grid = mask.grid;
    let volume_mm3: f64 = grid.size_mm().iter().product();
    let wanted = (params.debris_per_mm3 * volume_mm3).round() as u64;
    let numbers = Numbers::new(params.seed, 2);
    let mut placed = 0;
    for attempt in 0..20 * wanted {
        if placed == wanted {
            break;
        }
        let u = |n: u64| numbers.uniform(4 * attempt + n);
        let center: [f64; 3] = std::array::from_fn(|a| u(a as u64) * grid.n[a] as f64);
        let radius = 1.0 + 1.5 * u(3);
        let near = |clear: f64| {
            let bounds = |a: usize| {
                let low = (center[a] - radius - clear).floor().max(0.0) as usize;
                low..((center[a] + radius + clear).ceil() as usize).min(grid.n[a])
            };
            let [x, y, z] = [bounds(0), bounds(1), bounds(2)];
            let reach = (radius + clear) * (radius + clear);
            z.flat_map(move |k| y.clone().map(move |j| (k, j)))
                .flat_map(move |(k, j)| x.clone().map(move |i| [i, j, k]))
                .filter(move |p| {
                    let d2: f64 = (0..3)
                        .map(|a| (p[a] as f64 + 0.5 - center[a]) * (p[a] as f64 + 0.5 - center[a]))
                        .sum();
                    d2 <= reach
                })
        };
        if near(2.0).any(|p| mask.as_slice()[grid.index(p)] != 0) {
            continue;
        }
        for [i, j, k] in near(0.0) {
            bone.values[[k, j, i]] = 1.0;
        }
        placed += 1;
    }
    placed
}

#[cfg(test)]
mod tests {
    use super::super::{PhantomParams, structure};
    use crate::pipeline::segment::{SegmentParams, segment};

    #[test]
    fn segmenting_the_scan_finds_the_structure_again() {
        let params = PhantomParams {
            size_mm: [1.6; 3],
            debris_per_mm3: 10.0,
            ..Default::default()
        };
        let mut phantom = structure(&params).unwrap();
        let scan = super::scan(&mut phantom, &params);
        assert!(phantom.summary.debris > 20, "{:?}", phantom.summary);
        let scan = crate::volume::Volume::from_vec(
            scan.grid,
            scan.as_slice().iter().map(|&v| f32::from(v)).collect(),
        );
        let window = SegmentParams {
            lower: Some(200.0),
            upper: Some(5600.0),
            ..Default::default()
        };
        let s = segment("p", &scan, &window, None).unwrap();
        assert!(
            s.summary.components > phantom.summary.debris / 2,
            "{:?}",
            s.summary
        );
        let both = |a: u8, b: u8| u64::from(a == 1 && b == 1);
        let pairs = s
            .specimen
            .bone
            .as_slice()
            .iter()
            .zip(phantom.mask.as_slice());
        let shared: u64 = pairs.map(|(&a, &b)| both(a, b)).sum();
        let truth = (phantom.summary.bv_tv * scan.grid.len() as f64).round() as u64;
        let dice = 2.0 * shared as f64 / (truth + s.summary.bone_voxels) as f64;
        // Blur rounds edges and noise flips surface voxels: measured 0.98.
        assert!(dice > 0.95, "{dice}");
    }
}
