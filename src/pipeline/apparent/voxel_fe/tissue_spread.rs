//! Owns how strains and stresses are distributed over each tissue of solved voxel elements.

use crate::measure::distribution::distribution;
use crate::measure::principal::principal;
use crate::physics::hex8::fields::{Brick, Deformed};
use crate::pipeline::apparent::params::Sed;
use crate::pipeline::apparent::voxel_fe::sections::ALL;
use crate::result::details::TissueSpread;

/// Quantities and units, in the order of [`values`].
const QUANTITIES: [(&str, &str); 6] = [
    ("sed", "MPa"),
    ("effective_strain", ""),
    ("von_mises", "MPa"),
    ("principal_strain_1", ""),
    ("principal_strain_2", ""),
    ("principal_strain_3", ""),
];

fn values(brick: &Brick, sed: Sed) -> [f32; 6] {
    let [first, second, third] = principal(tensor(&brick.strain)).0.map(|v| v as f32);
    [
        density(brick, sed),
        effective_strain(brick, sed),
        brick.von_mises_mpa,
        first,
        second,
        third,
    ]
}

/// Of all bone and, of a labelled scan, of every label: one line a quantity. Elements weigh by their bone `fraction`.
pub fn spread<F: Fn(usize) -> (f32, u8) + Sync>(
    deformed: &Deformed<F>,
    sed: Sed,
    labels: &[i32],
    label: &(dyn Fn(usize) -> Option<i32> + Sync),
    fraction: &(dyn Fn(usize) -> f32 + Sync),
) -> Vec<TissueSpread> {
    let read = |b: &Brick| (label(b.element), fraction(b.element), values(b, sed));
    let elements = deformed.bricks(read);
    let tissues = [None].into_iter().chain(labels.iter().map(Some));
    let mut lines = Vec::new();
    for tissue in tissues {
        for (i, (quantity, unit)) in QUANTITIES.into_iter().enumerate() {
            let own = elements
                .iter()
                .filter(|(l, ..)| tissue.is_none() || l.as_ref() == tissue);
            let Some(d) = distribution(own.map(|(_, f, v)| (v[i], *f)).collect()) else {
                continue;
            };
            lines.push(TissueSpread {
                label: tissue.map_or(ALL.to_owned(), i32::to_string),
                quantity: quantity.to_owned(),
                unit: unit.to_owned(),
                elements: d.count as u64,
                mean: d.mean,
                sd: d.sd,
                skewness: d.skewness,
                minimum: d.minimum,
                p5: d.p5,
                p25: d.p25,
                median: d.median,
                p75: d.p75,
                p95: d.p95,
                maximum: d.maximum,
            });
        }
    }
    lines
}

/// The tensor of engineering strains.
pub fn tensor(strain: &[f32; 6]) -> [f64; 6] {
    std::array::from_fn(|i| f64::from(strain[i]) * if i < 3 { 1.0 } else { 0.5 })
}

/// The strain energy density that the settings ask for.
pub fn density(brick: &Brick, sed: Sed) -> f32 {
    match sed {
        Sed::Centre => brick.centre_energy_density_mpa,
        Sed::Mean => brick.mean_energy_density_mpa,
    }
}

/// `√(2 SED / E)` with that density.
pub fn effective_strain(brick: &Brick, sed: Sed) -> f32 {
    let density = f64::from(density(brick, sed).max(0.0));
    (2.0 * density / f64::from(brick.young_mpa)).sqrt() as f32
}
