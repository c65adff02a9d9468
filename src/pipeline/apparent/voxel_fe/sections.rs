//! Owns what each tissue carries through sections across the load axis: at both ends and in the middle.

use crate::discretisation::voxels::Planes;
use crate::physics::hex8::fields::Deformed;
use crate::pipeline::apparent::ends::motion::EndMotion;
use crate::pipeline::apparent::ends::reactions::cross;
use crate::result::details::SectionShare;
use std::collections::BTreeMap;

/// Through the layers of elements next to both grips and in the middle between them, for each label and for all: the force, or
/// moment about the middle of the grid, that the elements' upper nodes pass on. Summed over a section it is the reaction.
pub fn sections<F: Fn(usize) -> (f32, u8) + Sync>(
    deformed: &Deformed<F>,
    grips: Planes,
    motion: &EndMotion,
    label: &dyn Fn(usize) -> String,
) -> Vec<SectionShare> {
    let layers = [
        ("lower", grips.low),
        ("middle", (grips.low + grips.high - 1) / 2),
        ("upper", grips.high - 1),
    ];
    let section = |(name, layer)| section(deformed, layer, motion, label, name);
    layers.into_iter().flat_map(section).collect()
}

fn section<F: Fn(usize) -> (f32, u8) + Sync>(
    deformed: &Deformed<F>,
    layer: usize,
    motion: &EndMotion,
    label: &dyn Fn(usize) -> String,
    name: &str,
) -> Vec<SectionShare> {
    let (axis, h) = (motion.axis.index(), deformed.mesh.grid.spacing_mm);
    let mut sums: BTreeMap<String, (u64, f64)> = BTreeMap::new();
    for (element, at, forces) in deformed.layer_forces(axis, layer) {
        let upper = (0..8).filter(|corner| corner >> axis & 1 == 1);
        let passed: f64 = upper
            .map(|corner| {
                let place = std::array::from_fn(|a| (at[a] + (corner >> a & 1)) as f64 * h[a]);
                let force = forces[corner];
                motion.working(force, cross(motion.from_middle(place), force))
            })
            .sum();
        let sum = sums.entry(label(element)).or_default();
        *sum = (sum.0 + 1, sum.1 + passed);
    }
    let all = sums.values().fold((0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
    if sums.len() > 1 || !sums.contains_key(ALL) {
        sums.insert(ALL.to_owned(), all);
    }
    let by_angle = motion.motion.is_by_angle();
    let share = |(label, (elements, passed)): (String, (u64, f64))| SectionShare {
        section: name.to_owned(),
        label,
        elements,
        force_n: (!by_angle).then_some(passed),
        moment_nmm: by_angle.then_some(passed),
        share: match all.1 == 0.0 {
            true => 0.0,
            false => passed / all.1,
        },
    };
    sums.into_iter().map(share).collect()
}

/// The name of the whole bone among the labels.
pub const ALL: &str = "all";
