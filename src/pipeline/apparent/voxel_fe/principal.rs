//! Owns principal values and directions as fields: three values and a vector for each, from a tensor by voxel.

use crate::measure::principal::principal;
use crate::pipeline::apparent::fields::{FieldVolume, Place};
use crate::volume::Volume;

const AXES: &[&str] = &["x", "y", "z"];
const VALUES: &[&str] = &["1", "2", "3"];

/// Of six components by voxel, in the order 11, 22, 33, 23, 13, 12; `shear` is what makes the last three the tensor's own
/// (½ for engineering strains). Named `name` with its `unit` (`_mpa`, or empty).
pub fn principal_fields(
    components: &[Volume<f32>],
    shear: f64,
    name: &str,
    unit: &str,
) -> Vec<FieldVolume> {
    let voxels = components[0].as_slice().len();
    let mut values = vec![vec![0f32; voxels]; 3];
    let mut directions = vec![vec![vec![0f32; voxels]; 3]; 3];
    for v in 0..voxels {
        let at = |i: usize| f64::from(components[i].as_slice()[v]);
        let tensor = [0, 1, 2, 3, 4, 5].map(|i| at(i) * if i < 3 { 1.0 } else { shear });
        if tensor == [0.0; 6] {
            continue;
        }
        let (value, direction) = principal(tensor);
        for k in 0..3 {
            values[k][v] = value[k] as f32;
            (0..3).for_each(|a| directions[k][a][v] = direction[k][a] as f32);
        }
    }
    let volume = |values: Vec<f32>| Volume {
        affine: components[0].affine,
        ..Volume::from_vec(components[0].grid, values)
    };
    let of_values = FieldVolume {
        name: format!("{name}{unit}"),
        components: values.into_iter().map(volume).collect(),
        labels: VALUES,
        place: Place::Voxels,
        about: "principal values at element centres, largest first".to_owned(),
    };
    let of_directions = directions
        .into_iter()
        .enumerate()
        .map(|(k, d)| FieldVolume {
            name: format!("{name}_direction_{}", k + 1),
            components: d.into_iter().map(volume).collect(),
            labels: AXES,
            place: Place::Voxels,
            about: "unit vector along the specimen's x, y, z".to_owned(),
        });
    [of_values].into_iter().chain(of_directions).collect()
}
