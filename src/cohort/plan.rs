//! Owns the dry run: what each scan would need, without writing anything.

use crate::cohort::job::ScanJob;
use crate::cohort::outcome::{ScanResult, result};
use crate::command::estimate::{Estimate, of_specimen, time_in_words};
use crate::command::segment;
use crate::machine::host;
use crate::machine::session::Session;
use crate::recipe::Recipe;
use crate::result::cautions::cautions;
use crate::result::row::Row;
use crate::volume::Specimen;
use std::path::Path;

/// What would run. Every scan is read and segmented, so what its solves need is known.
pub(super) fn plan(
    recipe: &Recipe,
    jobs: &[ScanJob],
    estimates: &[Estimate],
    out: &Path,
    session: &Session,
) -> Vec<ScanResult> {
    let session = session.with_warnings_once();
    let bar = session.bar(jobs.len() as u64, "scans");
    let mut results = Vec::new();
    for (job, first) in jobs.iter().zip(estimates) {
        let to = out.join(&job.name);
        let quiet = Session {
            quiet: true,
            ..session.clone()
        };
        let own = Session {
            scan: Some(job.name.clone()),
            ..session.clone()
        };
        let known = segment::in_memory(&job.input, Some(&job.name), &job.segment, &quiet).and_then(
            |specimen| {
                let estimate = of_specimen(&specimen, first, recipe)?;
                warn_of_unusual(&specimen, recipe, &own);
                Ok(Estimate {
                    voxels: estimate.voxels.or(Some(specimen.bone.grid.n)),
                    ..estimate
                })
            },
        );
        bar.inc(1);
        let estimate = *known.as_ref().unwrap_or(first);
        results.push(match &known {
            Ok(e) => {
                let (to, from) = (to.display(), job.input.display());
                session.result(format!("{to} <- {from}: {e}"));
                result(job, estimate, None, None)
            }
            Err(e) => {
                session.warn(format!("{} would fail: {e}", job.name));
                result(job, estimate, Some(Err(e.clone())), None)
            }
        });
        if let Some(free) = host::available_mib().filter(|free| *free < estimate.memory_mib) {
            session.warn(format!("{} will not fit: {free:.0} MiB are free", job.name));
        }
    }
    bar.finish_and_clear();
    session.repeated_warnings();
    let estimates: Vec<Estimate> = results.iter().map(|r| r.estimate).collect();
    let seconds = estimates.iter().filter_map(|e| e.time_s).sum::<f64>();
    let time = match seconds {
        s if s < 1.0 => time_in_words(s),
        s => format!("about {}", time_in_words(s)),
    };
    let unknown = estimates.iter().filter(|e| e.time_s.is_none()).count();
    let rest = match unknown {
        0 => String::new(),
        n => format!(", and {n} whose time is not known before reading"),
    };
    session.result(format!(
        "scans: {}; {time} one after the other{rest}",
        jobs.len()
    ));
    results
}

/// What a run would warn of before its solves.
fn warn_of_unusual(specimen: &Specimen, recipe: &Recipe, session: &Session) {
    for solve in recipe.solves() {
        let row = Row {
            key: solve.key(specimen),
            ..Row::default()
        };
        let height_mm = specimen.length_mm(solve.axis);
        for caution in cautions(&row, height_mm) {
            session.warn(caution);
        }
    }
}
