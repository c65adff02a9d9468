//! Owns what a figure shows, as plain data: axes, curves, boxes. How it is drawn is not its business.

use serde::Serialize;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// Name of the file without extension; unique in a report.
    pub stem: String,
    /// The one scan it is about; None: all.
    pub scan: Option<String>,
    pub title: String,
    /// What one sees, in a sentence or two.
    pub caption: String,
    pub x: Axis,
    pub y: Axis,
    pub content: Content,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Axis {
    pub label: String,
    pub log: bool,
}

impl Axis {
    pub fn linear(label: &str) -> Axis {
        Axis {
            label: label.to_owned(),
            log: false,
        }
    }

    pub fn log(label: &str) -> Axis {
        Axis {
            label: label.to_owned(),
            log: true,
        }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Content {
    Curves(Vec<Curve>),
    /// Label and values of each box.
    Boxes(Vec<(String, Vec<f64>)>),
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
}
