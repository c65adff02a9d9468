//! Owns what is read off a body at the end of its load steps: its curve, forces, plastic strains, and what a reader must know.

use super::stopped_in_words;
use crate::operator::nonlinear::Incremental;
use crate::physics::hex8::plastic::points::Points;
use crate::physics::hex8::plastic::{PlasticBricks, State, Tissue};
use crate::pipeline::apparent::discretisation::steps::{History, Outcome, Step};
use crate::pipeline::apparent::discretisation::yielded::Yielded;
use crate::pipeline::apparent::voxel_fe::VoxelModel;
use crate::pipeline::apparent::voxel_fe::sections::ALL;
use crate::result::strength::{CurvePoint, YieldedShare, Yielding};
use std::collections::BTreeMap;

/// Radians of turn beyond which small strains no longer hold: the strain that a turn feigns is half its square.
const LARGE_TURN: f64 = 0.1;

/// Share of the bone so turned that is worth a word.
const WORTH_A_WORD: f64 = 0.001;

impl VoxelModel {
    pub(super) fn summary<T: Fn(usize) -> Tissue + Sync>(
        &self,
        history: History,
        outcome: Outcome,
        tissue: T,
    ) -> Yielded {
        let mesh = self.bricks.mesh();
        let points = Points::new(mesh.grid.spacing_mm, true);
        let mut force = vec![[0.0; 3]; mesh.len()];
        let mut body = PlasticBricks::new(&*self.bricks, mesh, points, tissue)
            .with_states(history.states.clone());
        body.forces(&history.u, &mut force);
        let turned = body.share_turned(&history.u, LARGE_TURN);
        let plastic = self.plastic_strains(&history.states);
        let mut said = vec![format!(
            "elements integrated by mean dilatation; elastic modulus, then {} load steps",
            history.steps.len()
        )];
        said.extend(stopped_in_words(outcome, &history));
        let cuts: u32 = history.steps.iter().map(|s| s.cuts).sum();
        if cuts > 0 {
            said.push(format!("{cuts} load steps failed and were halved"));
        }
        if turned > WORTH_A_WORD {
            said.push(format!(
                "small strains do not hold everywhere: {:.1} % of the bone has turned by more than {LARGE_TURN} rad",
                100.0 * turned
            ));
        }
        let shares = self.shares(&history.states, &plastic);
        if let Some(all) = shares.first() {
            said.push(format!(
                "{:.2} % of the bone has yielded",
                100.0 * all.yielded_share
            ));
        }
        Yielded {
            iterations: history.steps.iter().map(|s| s.iterations).sum(),
            yielding: Yielding {
                curve: self.curve(&history.steps),
                shares,
                stopped: outcome != Outcome::Done,
                said,
            },
            u: history.u,
            force,
            plastic,
        }
    }

    /// N and mm: works are in mJ.
    fn curve(&self, steps: &[Step]) -> Vec<CurvePoint> {
        let loaded = &self.motion.loaded;
        let points = 8.0 * self.bricks.mesh().elements as f64;
        let of = |(step, s): (u64, &Step)| {
            let force_n = s.conjugate_nmm / loaded.displacement_mm;
            CurvePoint {
                step,
                strain: s.load * loaded.displacement_mm / loaded.gauge_mm,
                stress_mpa: force_n / loaded.area_mm2,
                force_n,
                plastic_volume_fraction: s.yielded_points as f64 / points,
                energy_mj: s.elastic_nmm,
                dissipated_mj: s.dissipated_nmm,
                work_mj: s.work_nmm,
                iterations: s.iterations as u64,
            }
        };
        (1..).zip(steps).map(of).collect()
    }

    /// Means over the elements that have flowed.
    fn plastic_strains(&self, states: &[State]) -> Vec<(usize, f32)> {
        let mesh = self.bricks.mesh();
        let element = |node: usize| mesh.grid.index(mesh.indices(node).map(|v| v as usize));
        let mut all: Vec<(usize, f32)> = states
            .iter()
            .map(|s| {
                let sum: f64 = s.points.iter().map(|p| equivalent(&p.plastic_strain)).sum();
                (element(s.node as usize), (sum / 8.0) as f32)
            })
            .collect();
        all.sort_unstable_by_key(|(element, _)| *element);
        all
    }

    /// Of all bone first, then of each label.
    fn shares(&self, states: &[State], plastic: &[(usize, f32)]) -> Vec<YieldedShare> {
        let mesh = self.bricks.mesh();
        let label = |element: usize| self.labels.as_ref().map(|l| l.at(self.voxel(element)));
        let mut sums: BTreeMap<Option<i32>, (u64, usize, f64, f64)> = BTreeMap::new();
        for element in mesh.low_corner_elements().flatten() {
            sums.entry(None).or_default().0 += 1;
            if let Some(label) = label(element) {
                sums.entry(Some(label)).or_default().0 += 1;
            }
        }
        for state in states {
            let element = mesh
                .grid
                .index(mesh.indices(state.node as usize).map(|v| v as usize));
            let flowed = state.points.iter().filter(|p| p.hardening > 0.0).count();
            let at = plastic.binary_search_by_key(&element, |(e, _)| *e);
            let strain = at.map_or(0.0, |at| f64::from(plastic[at].1));
            for key in [Some(None), label(element).map(Some)].into_iter().flatten() {
                let sum = sums.entry(key).or_default();
                sum.1 += flowed;
                sum.2 += strain;
                sum.3 = sum.3.max(strain);
            }
        }
        let share = |(label, (elements, flowed, strain, most)): (Option<i32>, _)| {
            let elements: u64 = elements;
            let flowed: usize = flowed;
            YieldedShare {
                label: label.map_or(ALL.to_owned(), |l: i32| l.to_string()),
                elements,
                yielded_share: flowed as f64 / (8.0 * elements as f64),
                maximum_plastic_strain: most,
                mean_plastic_strain: strain / elements as f64,
            }
        };
        sums.into_iter().map(share).collect()
    }
}

/// `√(2/3 ε:ε)`, engineering shears.
fn equivalent(strain: &[f64; 6]) -> f64 {
    let normal: f64 = strain[..3].iter().map(|e| e * e).sum();
    let shear: f64 = strain[3..].iter().map(|e| 0.5 * e * e).sum();
    (2.0 / 3.0 * (normal + shear)).sqrt()
}
