//! Owns failure of solved elements by Pistoia's criterion: the load, the displacement and the strain at which it comes.

use crate::measure::apparent::EndWork;
use crate::measure::pistoia::Failure;
use crate::pipeline::apparent::ends::motion::EndMotion;
use crate::pipeline::apparent::params::SolveParams;
use crate::result::details::FailureAt;
use crate::result::settings::Motion;

/// The one of the settings' own critical volume.
pub fn chosen(failures: &[FailureAt], params: &SolveParams) -> Option<FailureAt> {
    let own = params.pistoia?.critical_volume;
    failures.iter().find(|f| f.critical_volume == own).cloned()
}

/// What a failure means of the load applied.
pub fn at(
    failure: &Failure,
    params: &SolveParams,
    motion: &EndMotion,
    work: &EndWork,
) -> FailureAt {
    let factor = failure.factor;
    let by_angle = motion.motion.is_by_angle();
    let by_ends = !by_angle && motion.motion != Motion::ByLabel;
    let labels: Vec<String> = params.failure_labels.iter().map(i32::to_string).collect();
    FailureAt {
        critical_volume: failure.criterion.critical_volume,
        critical_strain: failure.criterion.critical_strain,
        labels: match labels.is_empty() {
            true => "all".to_owned(),
            false => labels.join(";"),
        },
        strain_at_volume: failure.strain_at_volume,
        factor,
        failure_load_n: work.force_n.map(|f| factor * f),
        failure_moment_nmm: work.moment_nmm.map(|m| factor * m),
        failure_displacement_mm: by_ends.then(|| factor * motion.loaded.displacement_mm.abs()),
        failure_strain: by_ends.then(|| factor * params.strain.abs()),
        failure_angle_deg: by_angle.then(|| factor * params.angle_deg.abs()),
    }
}
