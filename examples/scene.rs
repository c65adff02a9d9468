//! One two-dimensional scene, through the library: `cargo run --release --example scene -- SCENE.toml OUT`.

use bonepd_ct::command::scene::{SceneRecord, scene};
use bonepd_ct::error::Result;
use bonepd_ct::machine::session::Session;
use std::path::Path;

/// Runs the scene file and returns what it found; maps and tables go to `out`.
pub fn run(file: &Path, out: &Path) -> Result<Option<SceneRecord>> {
    let session = Session {
        quiet: true,
        ..Session::default()
    };
    let (_, record) = scene(file, out, &session)?;
    Ok(record)
}

fn main() -> Result<()> {
    let mut words = std::env::args().skip(1);
    let file = words
        .next()
        .unwrap_or("pipelines/scene-plate-modes.toml".to_owned());
    let out = words.next().unwrap_or("out-example-scene".to_owned());
    if let Some(record) = run(Path::new(&file), Path::new(&out))? {
        println!("{}: {} points", record.title, record.summary.points);
        for (name, value) in &record.last {
            println!("{name} {value}");
        }
    }
    Ok(())
}
