//! Owns `scene` on disk: a scene file in, histories, fields, maps and a record out. Everything is written as the scene
//! runs, so that a scene that stops early leaves its last good state.

use crate::error::{Error, Result};
use crate::io::map::{self, Range};
use crate::io::{atomic, plot, points as files, scan, stiffness};
use crate::run::Outcome;
use crate::run::session::Session;
use crate::stage::report::figure::{Axis, Content, Curve, Figure, Mark, Point};
use crate::stage::scene::frame::{Field, Frame, Observer, Output, Summary, Values};
use crate::stage::scene::{Inputs, Physics, Scene, run};
use crate::topology::outline::{Bitmap, Outline};
use crate::topology::plane::Points;
use indicatif::ProgressBar;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// `scene.json`, and what `--json` prints.
#[derive(Debug, Clone, Serialize)]
pub struct SceneRecord {
    pub title: String,
    pub version: String,
    #[serde(flatten)]
    pub summary: Summary,
    pub unknowns_per_point: f64,
    pub wall_s: f64,
    /// Numbers of the last state.
    pub last: serde_json::Map<String, serde_json::Value>,
}

/// Runs the scene file `path` and writes its results into `out`.
pub fn scene(path: &Path, out: &Path, session: &Session) -> Result<(Outcome, Option<SceneRecord>)> {
    let text = std::fs::read_to_string(path).map_err(|e| {
        Error::file(
            path,
            format!("expected a scene, could not read it: {e}"),
            "`pipelines/` has example scenes",
        )
    })?;
    let mut scene = Scene::parse(&text, path)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut inputs = read_inputs(&mut scene, folder)?;
    inputs.stiffness = read_stiffness(&scene, folder)?;
    if session.dry_run {
        let points = scene.points(&inputs)?;
        session.say(format!(
            "{}: {} points; results would go to {}",
            scene.title,
            points.len(),
            out.display()
        ));
        return Ok((Outcome::Done, None));
    }
    atomic::create_dir(out)?;
    let begun = Instant::now();
    let mut writer = Writer::new(out, &scene.output, folder, session);
    let summary = run(&scene, &inputs, &mut writer)?;
    writer.finish()?;
    let record = SceneRecord {
        title: scene.title.clone(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        unknowns_per_point: summary.unknowns as f64 / summary.points.max(1) as f64,
        wall_s: begun.elapsed().as_secs_f64(),
        last: writer.last(),
        summary,
    };
    let json = serde_json::to_string_pretty(&record).expect("plain data");
    atomic::write(&out.join("scene.json"), json + "\n")?;
    session.say(in_words(&record));
    let outcome = if record.summary.converged {
        Outcome::Done
    } else {
        Outcome::NotConverged
    };
    Ok((outcome, Some(record)))
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

/// Files that a scene's geometry names, relative to the scene file.
fn read_inputs(scene: &mut Scene, folder: &Path) -> Result<Inputs> {
    match &mut scene.geometry {
        Outline::Polygon(polygon) => {
            if let Some(file) = &polygon.file {
                polygon.corners = files::read_corners(&folder.join(file))?;
            }
            Ok(Inputs::default())
        }
        Outline::Image(image) => {
            let (n, values) = map::read_brightness(&folder.join(&image.file))?;
            let inside = values.iter().map(|v| *v >= 0.5).collect();
            Ok(Inputs {
                bitmap: Some(Bitmap { n, inside }),
                grey: Some(values),
                ..Inputs::default()
            })
        }
        Outline::Slice(slice) => {
            let (n, mask) = read_slice(&folder.join(&slice.file), slice.axis.index(), slice.index)?;
            let inside = mask.iter().map(|v| *v != 0.0).collect();
            let grey = match &slice.grey {
                Some(file) => {
                    let path = folder.join(file);
                    let (other, values) = read_slice(&path, slice.axis.index(), slice.index)?;
                    if other != n {
                        return Err(Error::file(
                            path,
                            format!("its slice has {other:?} pixels, the mask's {n:?}"),
                            "give the scan the mask was made from, cropped alike",
                        ));
                    }
                    Some(values)
                }
                None => None,
            };
            Ok(Inputs {
                bitmap: Some(Bitmap { n, inside }),
                grey,
                ..Inputs::default()
            })
        }
        _ => Ok(Inputs::default()),
    }
}

/// The apparent stiffness that a continuum-molecular scene takes from a scan, if it does.
fn read_stiffness(scene: &Scene, folder: &Path) -> Result<Option<[[f64; 6]; 6]>> {
    let Physics::ContinuumMolecular(model) = &scene.physics else {
        return Ok(None);
    };
    let scan = model.elasticity.as_ref().and_then(|e| e.from_scan.as_ref());
    scan.map(|s| stiffness::read(&folder.join(&s.file)))
        .transpose()
}

/// Slice `index` along `axis`: the two other axes in order, the first fastest.
fn read_slice(path: &Path, axis: usize, index: usize) -> Result<([usize; 2], Vec<f64>)> {
    let scan = scan::read(path, Some([1.0; 3]))?;
    let n = scan.volume.grid.n;
    if index >= n[axis] {
        return Err(Error::file(
            path,
            format!(
                "slice {index} was asked for, there are {} along {}",
                n[axis],
                ["x", "y", "z"][axis]
            ),
            "correct geometry.slice.index",
        ));
    }
    let across: Vec<usize> = (0..3).filter(|a| *a != axis).collect();
    let size = [n[across[0]], n[across[1]]];
    let values = scan.volume.as_slice();
    let at = |i: usize, j: usize| {
        let mut voxel = [0; 3];
        (voxel[axis], voxel[across[0]], voxel[across[1]]) = (index, i, j);
        values[scan.volume.grid.index(voxel)] as f64
    };
    let slice = (0..size[1])
        .flat_map(|j| (0..size[0]).map(move |i| (i, j)))
        .map(|(i, j)| at(i, j));
    Ok((size, slice.collect()))
}

/// Scalar fields by name.
type Scalars = Vec<(&'static str, Vec<f64>)>;

/// Writes what a scene reports.
struct Writer<'a> {
    out: &'a Path,
    output: &'a Output,
    minus: Option<PathBuf>,
    session: &'a Session,
    bar: ProgressBar,
    points: Option<Points>,
    history: Vec<Frame>,
    /// Scalars to draw, by time.
    maps: Vec<(f64, Scalars)>,
    series: Vec<(PathBuf, f64)>,
}

impl<'a> Writer<'a> {
    fn new(out: &'a Path, output: &'a Output, folder: &Path, session: &'a Session) -> Self {
        Writer {
            out,
            output,
            minus: output.minus.as_ref().map(|p| folder.join(p)),
            session,
            bar: ProgressBar::hidden(),
            points: None,
            history: Vec::new(),
            maps: Vec::new(),
            series: Vec::new(),
        }
    }

    fn last(&self) -> serde_json::Map<String, serde_json::Value> {
        let numbers = self
            .history
            .last()
            .map(|f| f.numbers.clone())
            .unwrap_or_default();
        numbers
            .into_iter()
            .map(|(name, v)| (name, serde_json::json!(v)))
            .collect()
    }

    fn write_history(&self) -> Result<()> {
        let Some(first) = self.history.first() else {
            return Ok(());
        };
        let names: Vec<&str> = first.numbers.iter().map(|(n, _)| n.as_str()).collect();
        atomic::write_with(&self.out.join("history.csv"), |out| {
            use std::io::Write;
            writeln!(out, "t,{}", names.join(","))?;
            for frame in &self.history {
                write!(out, "{}", frame.time)?;
                frame
                    .numbers
                    .iter()
                    .try_for_each(|(_, v)| write!(out, ",{v}"))?;
                writeln!(out)?;
            }
            Ok(())
        })
    }

    fn write_fields(&mut self, frame: &Frame) -> Result<()> {
        let Some(points) = &self.points else {
            return Ok(());
        };
        let name = format!("fields_t{}", frame.time);
        files::write_csv(&self.out.join(format!("{name}.csv")), points, &frame.fields)?;
        if self.output.vtk {
            let path = self.out.join(format!("{name}.vtk"));
            files::write_vtk(&path, points, &frame.fields, frame.time)?;
            self.series.push((path, frame.time));
            files::write_series(&self.out.join("fields.vtk.series"), &self.series)?;
        }
        self.maps.push((frame.time, self.scalars(&frame.fields)));
        Ok(())
    }

    fn scalars(&self, fields: &[Field]) -> Scalars {
        let wanted = |name: &str| match self.output.maps.is_empty() {
            true => true,
            false => self.output.maps.iter().any(|m| m == name),
        };
        let scalar = |f: &Field| match &f.values {
            Values::Scalar(v) if wanted(f.name) => Some((f.name, v.clone())),
            _ => None,
        };
        let mut all: Vec<_> = fields.iter().filter_map(scalar).collect();
        if self.output.maps.is_empty() {
            all.truncate(1);
        }
        all
    }

    /// Maps of each scalar with one range over all times, the animation, differences, and the curve of the first number.
    fn finish(&mut self) -> Result<()> {
        self.bar.finish_and_clear();
        self.write_history()?;
        let Some(points) = self.points.take() else {
            return Ok(());
        };
        let names: Vec<&'static str> = self
            .maps
            .first()
            .map(|(_, s)| s.iter().map(|(n, _)| *n).collect())
            .unwrap_or_default();
        for (k, name) in names.iter().enumerate() {
            let all = || {
                self.maps
                    .iter()
                    .filter_map(|(t, s)| s.get(k).map(|(_, v)| (*t, v)))
            };
            let range = match self.output.range.filter(|_| k == 0) {
                Some([low, high]) => Range { low, high },
                None => Range::of(all().flat_map(|(_, v)| v)),
            };
            let mut pictures = Vec::new();
            for (t, values) in all() {
                let picture = map::draw(&points, values, range, t);
                map::write_png(&self.out.join(format!("{name}_t{t}.png")), &picture)?;
                pictures.push(picture);
            }
            if self.output.animation {
                map::write_gif(&self.out.join(format!("{name}.gif")), pictures)?;
            }
        }
        self.draw_curves()?;
        match self.minus.clone() {
            Some(other) => self.differences(&points, &other),
            None => Ok(()),
        }
    }

    fn draw_curves(&self) -> Result<()> {
        let Some((name, _)) = self.history.first().and_then(|f| f.numbers.first()) else {
            return Ok(());
        };
        let points = self
            .history
            .iter()
            .map(|f| Point::new(f.time, f.numbers[0].1))
            .collect();
        let figure = Figure {
            stem: "history".into(),
            scan: None,
            title: String::new(),
            caption: String::new(),
            x: Axis::linear("time"),
            y: Axis::linear(name),
            content: Content::Curves(vec![Curve {
                name: name.clone(),
                hue: 0,
                shape: 0,
                mark: Mark::Rule,
                points,
            }]),
        };
        let drawing = plot::draw(&figure);
        atomic::write(&self.out.join("history.svg"), drawing.svg())?;
        atomic::write(&self.out.join("history.png"), drawing.png()?)
    }

    /// The first map less that of another run on the same points, at the times both have.
    fn differences(&self, points: &Points, other: &Path) -> Result<()> {
        let mut rows =
            vec!["t,mean,mean_abs,p95_abs,max_abs,share_above_0.1,share_above_0.3".to_owned()];
        for (t, scalars) in &self.maps {
            let Some((name, values)) = scalars.first() else {
                continue;
            };
            let file = other.join(format!("fields_t{t}.csv"));
            if !file.exists() {
                continue;
            }
            let minus = files::read_column(&file, name)?;
            let near = |p: usize| {
                let (at, here) = (minus[p].0, points.position(p));
                (0..2).all(|d| (at[d] - here[d]).abs() < 1e-6 * points.spacing)
            };
            if minus.len() != points.len() || !(0..points.len()).all(near) {
                return Err(Error::file(
                    file,
                    "its points are not those of this scene",
                    "compare scenes of one geometry and spacing",
                ));
            }
            let change: Vec<f64> = values.iter().zip(&minus).map(|(a, (_, b))| a - b).collect();
            rows.push(difference_row(*t, &change));
            let picture = map::draw(
                points,
                &change,
                Range {
                    low: -0.3,
                    high: 0.3,
                },
                *t,
            );
            map::write_png(&self.out.join(format!("difference_t{t}.png")), &picture)?;
        }
        atomic::write(&self.out.join("difference.csv"), rows.join("\n") + "\n")
    }
}

fn difference_row(t: f64, change: &[f64]) -> String {
    let n = change.len() as f64;
    let mut size: Vec<f64> = change.iter().map(|v| v.abs()).collect();
    size.sort_unstable_by(f64::total_cmp);
    let above = |limit: f64| size.iter().filter(|v| **v > limit).count() as f64 / n;
    let mean = change.iter().sum::<f64>() / n;
    let mean_abs = size.iter().sum::<f64>() / n;
    let p95 = size[((size.len() - 1) as f64 * 0.95) as usize];
    format!(
        "{t},{mean},{mean_abs},{p95},{},{},{}",
        size[size.len() - 1],
        above(0.1),
        above(0.3)
    )
}

impl Observer for Writer<'_> {
    fn start(&mut self, points: &Points, steps: usize) -> Result<()> {
        self.points = Some(points.clone());
        self.bar = self.session.bar(steps as u64, "scene");
        Ok(())
    }

    fn frame(&mut self, frame: &Frame) -> Result<()> {
        let row = Frame {
            fields: Vec::new(),
            ..frame.clone()
        };
        self.history.push(row);
        if !frame.fields.is_empty() {
            self.write_history()?;
            self.write_fields(frame)?;
        }
        self.bar.inc(1);
        Ok(())
    }

    fn say(&mut self, line: &str) {
        self.bar.suspend(|| self.session.detail(line));
    }
}
