//! Owns what a running scene leaves on disk: history, fields, maps, the animation, and the state to go on from.

mod saved_state;

use super::differences::{self, Other, Scalars};
use crate::discretisation::plane::Points;
use crate::draw::map;
use crate::draw::map::Range;
use crate::error::{Error, Result};
use crate::export::points as files;
use crate::io::atomic;
use crate::machine::session::Session;
use crate::record::history;
use crate::report::figure::{Axis, Content, Curve, Figure, Mark, Point};
use crate::report::plot;
use crate::scene::frame::{Directions, Field, Frame, Observer, Output, Values};
use crate::scene::state::State;
use indicatif::ProgressBar;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Longest time between two saved states.
const EVERY: Duration = Duration::from_secs(10);

/// Writes what a scene reports.
pub struct Writer<'a> {
    out: &'a Path,
    output: &'a Output,
    /// Folder of the scene to compare with, then its fields.
    minus: Option<PathBuf>,
    other: Option<Other>,
    session: &'a Session,
    bar: ProgressBar,
    points: Option<Points>,
    history: Vec<Frame>,
    /// Scalars to draw, by time.
    maps: Vec<(f64, Scalars)>,
    /// Of the scene, as a kept state names it.
    fingerprint: String,
    kept: Instant,
    pub every: Duration,
}

impl<'a> Writer<'a> {
    /// `fingerprint` is the scene's: a state of another is not gone on from.
    pub fn new(
        out: &'a Path,
        output: &'a Output,
        folder: &Path,
        fingerprint: String,
        session: &'a Session,
    ) -> Self {
        Writer {
            out,
            output,
            minus: output.minus.as_ref().map(|p| folder.join(p)),
            other: None,
            session,
            bar: ProgressBar::hidden(),
            points: None,
            history: Vec::new(),
            maps: Vec::new(),
            fingerprint,
            kept: Instant::now(),
            every: EVERY,
        }
    }

    /// Numbers of the last state.
    pub fn last(&self) -> serde_json::Map<String, serde_json::Value> {
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
        history::write(&self.out.join("history.csv"), &self.history)
    }

    fn write_fields(&mut self, frame: &Frame) -> Result<()> {
        self.check_maps(&frame.fields)?;
        let Some(points) = &self.points else {
            return Ok(());
        };
        let name = format!("fields_t{}", frame.time);
        files::write_csv(&self.out.join(format!("{name}.csv")), points, &frame.fields)?;
        if self.output.vtk {
            let path = self.out.join(format!("{name}.vtk"));
            files::write_vtk(&path, points, &frame.fields, frame.time)?;
        }
        self.maps.push((frame.time, self.scalars(&frame.fields)));
        if !self.output.vtk {
            return Ok(());
        }
        let file = |t: f64| (self.out.join(format!("fields_t{t}.vtk")), t);
        let series: Vec<_> = self.maps.iter().map(|(t, _)| file(*t)).collect();
        files::write_series(&self.out.join("fields.vtk.series"), &series)
    }

    /// # Errors
    /// A map of a field that there is not.
    fn check_maps(&self, fields: &[Field]) -> Result<()> {
        let scalar = |f: &&Field| matches!(f.values, Values::Scalar(_));
        let there: Vec<&str> = fields.iter().filter(scalar).map(|f| f.name).collect();
        match self
            .output
            .maps
            .iter()
            .find(|m| !there.contains(&m.as_str()))
        {
            None => Ok(()),
            Some(wrong) => Err(Error::setting(
                "output.maps",
                format!("found \"{wrong}\""),
                format!("this scene has {}", there.join(", ")),
            )),
        }
    }

    fn scalars(&self, fields: &[Field]) -> Scalars {
        let wanted = |name: &str| match self.output.maps.is_empty() {
            true => true,
            false => self.output.maps.iter().any(|m| m == name),
        };
        let scalar = |f: &Field| match &f.values {
            Values::Scalar(v) if wanted(f.name) => Some((f.name.to_owned(), v.clone())),
            _ => None,
        };
        let mut all: Vec<_> = fields.iter().filter_map(scalar).collect();
        if self.output.maps.is_empty() {
            all.truncate(1);
        }
        all
    }

    /// Maps of each scalar with one range over all times, the animation, differences, and the curve of the first number.
    pub fn finish(&mut self) -> Result<()> {
        self.bar.finish_and_clear();
        self.write_history()?;
        let Some(points) = self.points.take() else {
            return Ok(());
        };
        let names: Vec<String> = self
            .maps
            .first()
            .map(|(_, s)| s.iter().map(|(n, _)| n.clone()).collect())
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
        if let Some(other) = &self.other
            && let Some(words) = differences::write(self.out, &self.maps, &points, other)?
        {
            self.session.warn(words);
        }
        Ok(())
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
            x: Axis::linear("time"),
            y: Axis::linear(name),
            content: Content::Curves(vec![Curve {
                name: name.clone(),
                hue: 0,
                shape: 0,
                mark: Mark::Rule,
                points,
            }]),
            ..Figure::default()
        };
        let drawing = plot::draw(&figure);
        atomic::write(&self.out.join("history.svg"), drawing.svg())?;
        atomic::write(&self.out.join("history.png"), drawing.png()?)
    }
}

impl Observer for Writer<'_> {
    fn start(&mut self, points: &Points, steps: usize) -> Result<()> {
        if let Some(folder) = &self.minus {
            self.other = Some(Other::open(folder, points)?);
        }
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

    /// A scene that stops reports its last good state once more.
    fn again(&mut self, frame: &Frame) -> Result<()> {
        if self.history.last().is_some_and(|f| f.time == frame.time) {
            self.history.pop();
        }
        if self.maps.last().is_some_and(|(t, _)| *t == frame.time) {
            self.maps.pop();
        }
        self.frame(frame)
    }

    fn directions(&mut self, directions: &Directions) -> Result<()> {
        let columns = &directions.columns;
        atomic::write_with(&self.out.join("directions.csv"), |out| {
            let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
            writeln!(out, "angle_deg,{}", names.join(","))?;
            for k in 0..columns.first().map_or(0, |(_, values)| values.len()) {
                write!(out, "{k}")?;
                columns
                    .iter()
                    .try_for_each(|(_, v)| write!(out, ",{}", v[k]))?;
                writeln!(out)?;
            }
            Ok(())
        })
    }

    fn say(&mut self, line: &str) {
        self.bar.suspend(|| self.session.detail(line));
    }

    fn warn(&mut self, line: &str) {
        self.bar.suspend(|| self.session.warn(line));
    }

    fn resume(&mut self) -> Result<Option<State>> {
        self.last_state()
    }

    fn keep(&mut self, state: &dyn Fn() -> State) -> Result<()> {
        self.keep_state(state)
    }
}
