//! Owns where and when a scene is held and loaded.

use crate::discretisation::plane::Points;
use crate::discretisation::plane::layers::Edge;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// A set of points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Region {
    All,
    /// Points in the outermost row or column of the bounding box.
    Edge(Edge),
    /// `[x low, y low, x high, y high]`, borders included.
    Box([f64; 4]),
    /// `[centre x, centre y, radius]`, border included.
    Disc([f64; 3]),
    /// Outside a circle: `[centre x, centre y, radius]`, border excluded.
    Outside([f64; 3]),
    /// The point nearest to `[x, y]`, at most two spacings away.
    Point([f64; 2]),
    /// Inside a polygon.
    Polygon(Vec<[f64; 2]>),
}

impl Region {
    /// Points among the first `count` that belong to the region. An empty region is refused, naming `key`.
    pub fn select(&self, points: &Points, count: usize, key: &str) -> Result<Vec<usize>> {
        let chosen: Vec<usize> = match self {
            Region::Point(p) => points.nearest(*p).into_iter().collect::<Vec<_>>(),
            _ => (0..count).filter(|&i| self.holds(points, i)).collect(),
        };
        if let (Region::Point(wanted), [found]) = (self, chosen.as_slice()) {
            require_near(points, *wanted, *found, key)?;
        }
        if chosen.is_empty() {
            return Err(Error::setting(
                key,
                "no point of the geometry lies there",
                "move or enlarge it; it must cover the centre of at least one cell",
            ));
        }
        Ok(chosen)
    }

    fn holds(&self, points: &Points, i: usize) -> bool {
        let [x, y] = points.position(i);
        let r2 = |c: &[f64; 3]| (x - c[0]).powi(2) + (y - c[1]).powi(2);
        match self {
            Region::All => true,
            Region::Edge(edge) => {
                let (axis, sign) = edge.normal();
                let (low, n) = points.bounds();
                let last = if sign > 0 { n[axis] as i32 - 1 } else { 0 };
                points.cell(i)[axis] == low[axis] + last
            }
            Region::Box(b) => b[0] <= x && x <= b[2] && b[1] <= y && y <= b[3],
            Region::Disc(c) => r2(c) <= c[2] * c[2],
            Region::Outside(c) => r2(c) > c[2] * c[2],
            Region::Point(p) => points.nearest(*p) == Some(i),
            Region::Polygon(corners) => {
                crate::discretisation::plane::geometry::winds(corners, [x, y])
            }
        }
    }
}

/// # Errors
/// A point that stands for a place outside the geometry.
fn require_near(points: &Points, wanted: [f64; 2], found: usize, key: &str) -> Result<()> {
    let [x, y] = points.position(found);
    let distance = (x - wanted[0]).hypot(y - wanted[1]);
    if distance <= 2.0 * points.spacing {
        return Ok(());
    }
    Err(Error::setting(
        key,
        format!(
            "no point of the geometry lies at [{}, {}]: the nearest is [{x:.4}, {y:.4}], {distance:.4} away",
            wanted[0], wanted[1]
        ),
        "give a place on the body",
    ))
}

/// A value over time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a number, { times = [..], values = [..] } (straight lines between, last value kept) or \
                 { until = [..], values = [..] } (steps)"
)]
pub enum Schedule {
    Constant(f64),
    Lines(Lines),
    Steps(Steps),
}

/// Straight lines between `(times, values)`; constant before the first and after the last.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lines {
    pub times: Vec<f64>,
    pub values: Vec<f64>,
}

/// `values[k]` for `until[k-1] < t <= until[k]`; the last value is kept.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Steps {
    pub until: Vec<f64>,
    pub values: Vec<f64>,
}

impl Schedule {
    pub fn at(&self, t: f64) -> f64 {
        match self {
            Schedule::Constant(value) => *value,
            Schedule::Steps(s) => {
                // A step ends at its time up to rounding of accumulated time steps.
                let k = s.until.iter().position(|&end| t <= end + 1e-9 * end.abs());
                s.values[k.unwrap_or(s.values.len() - 1)]
            }
            Schedule::Lines(l) => {
                let k = l.times.partition_point(|&time| time <= t);
                if k == 0 || k == l.times.len() {
                    return l.values[k.max(1) - 1];
                }
                let share = (t - l.times[k - 1]) / (l.times[k] - l.times[k - 1]);
                l.values[k - 1] + share * (l.values[k] - l.values[k - 1])
            }
        }
    }

    /// Times at which the schedule jumps or bends.
    pub fn corners(&self) -> &[f64] {
        match self {
            Schedule::Constant(_) => &[],
            Schedule::Lines(l) => &l.times,
            Schedule::Steps(s) => &s.until,
        }
    }

    /// Refuses lists of different lengths, times that do not ascend, and values that are not numbers.
    pub fn check(&self, key: &str) -> Result<()> {
        let (times, values): (&[f64], &[f64]) = match self {
            Schedule::Constant(value) => (&[0.0], std::slice::from_ref(value)),
            Schedule::Lines(l) => (&l.times, &l.values),
            Schedule::Steps(s) => (&s.until, &s.values),
        };
        let ascend = times.windows(2).all(|w| w[0] < w[1]);
        if let Some(wrong) = times.iter().chain(values).find(|v| !v.is_finite()) {
            return Err(Error::setting(
                key,
                format!("found {wrong}"),
                "give finite numbers",
            ));
        }
        if times.len() == values.len() && !times.is_empty() && ascend {
            return Ok(());
        }
        Err(Error::setting(
            key,
            format!(
                "expected as many values as ascending times, found {} and {}",
                values.len(),
                times.len()
            ),
            "give one value for each time",
        ))
    }
}

/// A prescribed value: displacement, temperature, potential, whatever the physics calls `component`. Where two holds of one
/// component meet, the later one of the file holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hold {
    pub region: Region,
    pub component: String,
    #[serde(default = "zero")]
    pub value: Schedule,
}

/// A prescribed force or source: `value` is the total over the region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load {
    pub region: Region,
    pub component: String,
    pub value: Schedule,
    /// The load case that it belongs to, where the physics has several; absent: all of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub case: Option<String>,
}

fn zero() -> Schedule {
    Schedule::Constant(0.0)
}

/// Fictitious layers beyond two opposite edges, moved by `displacement` outwards.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layers {
    pub edges: Vec<Edge>,
    /// Outward displacement of each edge.
    pub displacement: Schedule,
    /// Rows of points; by default as many as the horizon reaches.
    #[serde(default)]
    pub depth: Option<usize>,
    #[serde(default)]
    pub normal: Normal,
    #[serde(default)]
    pub lateral: Lateral,
    #[serde(default)]
    pub density: LayerDensity,
}

/// How fictitious points move along the edge's normal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum Normal {
    /// They continue the affine stretch of the whole body between the two edges.
    #[default]
    Affine,
    /// They move with the edge as a rigid body.
    Rigid,
}

/// How fictitious points move along the edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum Lateral {
    /// With the point they mirror: the edge is free to contract.
    #[default]
    Mirrored,
    /// Not at all.
    Clamped,
}

/// The density of fictitious points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum LayerDensity {
    /// That of the point they mirror.
    #[default]
    Mirrored,
    /// The reference density ρ*, at all times.
    Fixed,
}

/// Time stepping.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Time {
    pub end: f64,
    pub step: f64,
    /// Let steps grow: each is a whole number of `step`s, such that the error an implicit Euler step adds to the
    /// relative densities (root mean square) stays near this. Steps still end on all times of outputs and of corners in
    /// holds and loads, and start small again after the latter. Absent: all steps are `step`.
    #[serde(default)]
    pub tolerance: Option<f64>,
    /// A step that fails is halved down to this share of `step`, and grown back after four that succeed.
    #[serde(default = "smallest_share")]
    pub smallest_share: f64,
}

fn smallest_share() -> f64 {
    1.0 / 1024.0
}

impl Time {
    /// Whether steps may grow or shrink: settings of scenes that march.
    pub fn adapts(&self) -> bool {
        self.tolerance.is_some() || self.smallest_share != smallest_share()
    }

    pub fn check(&self) -> Result<()> {
        let positive = self.end > 0.0 && self.step > 0.0 && self.step <= self.end;
        let usable = self.tolerance.is_none_or(|t| t.is_finite() && t > 0.0);
        if positive
            && usable
            && self.end.is_finite()
            && (1e-12..=1.0).contains(&self.smallest_share)
        {
            return Ok(());
        }
        Err(Error::setting(
            "time",
            format!(
                "found end = {}, step = {}, tolerance = {:?}",
                self.end, self.step, self.tolerance
            ),
            "all must be positive and step not above end; smallest_share is between 1e-12 and 1",
        ))
    }

    /// The number of steps to the end.
    ///
    /// # Errors
    /// Times that cannot be, or an end that is not a whole number of steps.
    pub fn steps(&self) -> Result<u64> {
        self.check()?;
        let steps = (self.end / self.step).round() as u64;
        if steps == 0 || ((steps as f64 * self.step - self.end) / self.end).abs() > 1e-9 {
            return Err(Error::setting(
                "time.end",
                format!(
                    "{} is not a whole number of steps of {}",
                    self.end, self.step
                ),
                "change one of them",
            ));
        }
        Ok(steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schedules_step_and_ramp() {
        let steps = Schedule::Steps(Steps {
            until: vec![2.0, 4.0],
            values: vec![1.0, 5.0],
        });
        assert_eq!([2.0, 2.1, 9.0].map(|t| steps.at(t)), [1.0, 5.0, 5.0]);
        let lines = Schedule::Lines(Lines {
            times: vec![0.0, 2.0, 3.0],
            values: vec![0.0, 4.0, 0.0],
        });
        assert_eq!(
            [-1.0, 0.0, 0.5, 2.0, 2.5, 8.0].map(|t| lines.at(t)),
            [0.0, 0.0, 1.0, 4.0, 2.0, 0.0]
        );
        let broken = Schedule::Lines(Lines {
            times: vec![1.0, 1.0],
            values: vec![0.0, 0.0],
        });
        assert!(broken.check("hold.value").is_err());
    }

    #[test]
    fn regions_select_points() {
        let points = Points::from_box([0.0; 2], 1.0, [4, 3], |_| true);
        let count = |r: Region| r.select(&points, 12, "hold").map(|v| v.len());
        assert_eq!(count(Region::Edge(Edge::Top)).unwrap(), 4);
        assert_eq!(count(Region::Box([0.0, 0.0, 2.0, 1.0])).unwrap(), 2);
        assert_eq!(count(Region::Outside([0.5, 0.5, 0.1])).unwrap(), 11);
        assert_eq!(count(Region::Point([3.6, 2.4])).unwrap(), 1);
        assert!(count(Region::Point([9.0, 9.0])).is_err());
        assert!(count(Region::Disc([9.0, 9.0, 1.0])).is_err());
    }
}
