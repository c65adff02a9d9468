//! Owns `scene` on disk: a scene file in, histories, fields, maps and a record out. Everything is written as the scene
//! runs, so that a scene that stops early leaves its last good state.

mod clear_previous;
mod differences;
mod inputs;
mod writer;

use crate::command::Outcome;
use crate::error::{Error, Result};
use crate::io::atomic;
use crate::machine::session::Session;
pub use crate::scene::frame::Summary;
use crate::scene::setting::Inputs;
pub use crate::scene::step_statistics::StepStatistics;
use crate::scene::{Scene, check, run};
use serde::Serialize;
use std::path::Path;
use std::time::Instant;
use writer::Writer;

/// `scene.json`, and what `--json` prints.
#[derive(Debug, Clone, Serialize)]
pub struct SceneRecord {
    /// From the scene file.
    pub title: String,
    /// Version of the program.
    pub version: String,
    /// How the scene ended.
    #[serde(flatten)]
    pub summary: Summary,
    /// Unknowns over points.
    pub unknowns_per_point: f64,
    /// Wall time in seconds.
    pub wall_s: f64,
    /// Numbers of the last state.
    pub last: serde_json::Map<String, serde_json::Value>,
}

/// Runs the scene file `path` and writes its results into `out`. A scene of remodelling or fracture, or a sweep, that was stopped resumes
/// from the last state saved there, unless forced to start from the beginning.
pub fn scene(path: &Path, out: &Path, session: &Session) -> Result<(Outcome, Option<SceneRecord>)> {
    let text = std::fs::read_to_string(path).map_err(|e| {
        Error::file(
            path,
            format!("expected a scene, could not read it: {e}"),
            "`pipelines/` has example scenes",
        )
        .caused_by(e)
    })?;
    let mut scene = Scene::parse(&text, path)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut inputs = inputs::read(&mut scene, folder, |line| session.warn(line))?;
    inputs.stiffness = inputs::read_stiffness(&scene, folder)?;
    if session.dry_run {
        let points = check(&scene, &inputs)?.points()?;
        session.say(format!(
            "{}: {} points; results would go to {}",
            scene.setting.title,
            points.len(),
            out.display()
        ));
        return Ok((Outcome::Done, None));
    }
    atomic::create_dir(out)?;
    atomic::sweep(out);
    let started = Instant::now();
    let fingerprint = fingerprint(&scene, &inputs);
    let mut writer = Writer::new(out, &scene.setting.output, folder, fingerprint, session);
    if !writer.goes_on() {
        clear_previous::clear(out)?;
    }
    let summary = run(&scene, &inputs, &mut writer)?;
    writer.finish()?;
    let record = SceneRecord {
        title: scene.setting.title.clone(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        unknowns_per_point: summary.unknowns as f64 / summary.points.max(1) as f64,
        wall_s: started.elapsed().as_secs_f64(),
        last: writer.last(),
        summary,
    };
    let json = serde_json::to_string_pretty(&record).expect("plain data");
    atomic::write(&out.join("scene.json"), json + "\n")?;
    writer.forget()?;
    session.say(in_words(&record));
    if let Some(pace) = record
        .summary
        .step_statistics
        .as_ref()
        .filter(|p| p.changed())
    {
        session.say(pace.to_string());
    }
    let outcome = if record.summary.converged {
        Outcome::Done
    } else {
        Outcome::NotConverged
    };
    Ok((outcome, Some(record)))
}

/// Tells scenes apart that go different ways: by the program's version, the scene as it is written, and the values of its files.
fn fingerprint(scene: &Scene, inputs: &Inputs) -> String {
    let mut hasher = blake3::Hasher::new();
    // TOML writes infinite limits of regions too.
    let scene = toml::to_string(scene).expect("a scene is plain data");
    let bitmap = inputs.bitmap.as_ref();
    let parts: [&[u8]; 6] = [
        env!("CARGO_PKG_VERSION").as_bytes(),
        scene.as_bytes(),
        bitmap.map_or(&[], |b| bytemuck::bytes_of(&b.n)),
        bitmap.map_or(&[], |b| bytemuck::cast_slice(&b.inside)),
        bytemuck::cast_slice(inputs.grey.as_deref().unwrap_or_default()),
        inputs.stiffness.as_ref().map_or(&[], bytemuck::bytes_of),
    ];
    for part in parts {
        hasher.update(&part.len().to_le_bytes()).update(part);
    }
    hasher.finalize().to_hex().to_string()
}

fn in_words(record: &SceneRecord) -> String {
    let s = &record.summary;
    let end = match &s.stopped {
        Some(why) => format!("stopped {why}"),
        None => "done".to_owned(),
    };
    format!(
        "{}: {} points, {} unknowns, {} steps in {:.1} s, {end}",
        record.title, s.points, s.unknowns, s.steps, record.wall_s
    )
}

#[cfg(test)]
mod tests;
