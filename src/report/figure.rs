//! Owns what a figure shows, as plain data: axes, curves, groups of points. How it is drawn is not its business.

use serde::Serialize;

#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct Figure {
    /// Name of the file without extension; unique in a report.
    pub stem: String,
    /// The one scan it is about; None: all.
    pub scan: Option<String>,
    /// Of methods and times rather than of bone: behind a fold of the page.
    pub folded: bool,
    pub title: String,
    /// What one sees, in a sentence or two.
    pub caption: String,
    pub x: Axis,
    pub y: Axis,
    pub content: Content,
}

#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct Axis {
    pub label: String,
    pub log: bool,
    /// Words in place of the numbers 1, 2, 3, …
    pub categories: Vec<String>,
}

impl Axis {
    pub fn linear(label: &str) -> Axis {
        Axis {
            label: label.to_owned(),
            ..Axis::default()
        }
    }

    pub fn log(label: &str) -> Axis {
        Axis {
            log: true,
            ..Axis::linear(label)
        }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Content {
    Curves(Vec<Curve>),
    /// Side by side, each at its label.
    Groups(Vec<GroupOfPoints>),
}

impl Default for Content {
    fn default() -> Self {
        Content::Curves(Vec::new())
    }
}

/// Values of one group, with what describes them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GroupOfPoints {
    pub label: String,
    pub hue: usize,
    pub values: Vec<f64>,
    /// Mean, and the ends of its interval.
    pub mean: Option<[f64; 3]>,
    pub median: Option<f64>,
}

/// A named series of points. Curves of one hue have one colour, of one shape one marker and dash, in every figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Curve {
    pub name: String,
    pub hue: usize,
    pub shape: usize,
    pub mark: Mark,
    pub points: Vec<Point>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Mark {
    /// Markers joined by a line.
    Joined,
    Points,
    /// A dashed line without markers.
    Rule,
}

/// `y_error` reaches down and up from `y`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Point {
    pub x: f64,
    pub y: f64,
    pub y_error: Option<[f64; 2]>,
}

impl Point {
    pub fn new(x: f64, y: f64) -> Point {
        Point {
            x,
            y,
            y_error: None,
        }
    }

    /// A modulus with its stated error. The bar ends at 0: no modulus is below.
    pub fn modulus(x: f64, e_app_mpa: f64, error_mpa: Option<f64>) -> Point {
        Point {
            x,
            y: e_app_mpa,
            y_error: error_mpa.map(|e| [e.min(e_app_mpa.max(0.0)), e]),
        }
    }
}
