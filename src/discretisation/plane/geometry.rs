//! Owns the outlines a scene can be cut from, and the points inside them.

use crate::discretisation::plane::Points;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Where the points of a scene are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Geometry {
    /// Centred on the origin; the edges must be whole numbers of cells.
    Rectangle(Rectangle),
    /// The cells whose centre is nearer than `radius`; a cell corner sits on `centre`.
    Disc(Disc),
    /// The cells whose centre is inside; cell corners sit on multiples of the spacing.
    Polygon(Polygon),
    /// An image: pixels at least half bright are inside. One pixel is one cell.
    Image(Image),
    /// One slice of a segmented scan; non-zero voxels are inside. One voxel is one cell.
    Slice(Slice),
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rectangle {
    pub size: [f64; 2],
    /// Points on the edges too (`n + 1` of them along an edge of `n` cells), instead of cell centres.
    #[serde(default)]
    pub nodal: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Disc {
    #[serde(default)]
    pub centre: [f64; 2],
    pub radius: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Polygon {
    /// Corners in order, either way round.
    #[serde(default)]
    pub corners: Vec<[f64; 2]>,
    #[serde(default)]
    pub holes: Vec<Vec<[f64; 2]>>,
    /// Round holes: centre x, centre y, radius.
    #[serde(default)]
    pub round_holes: Vec<[f64; 3]>,
    /// A CSV file of corners (columns `x,y`) instead of `corners`, relative to the scene file.
    #[serde(default)]
    pub file: Option<PathBuf>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Image {
    /// PNG, relative to the scene file.
    pub file: PathBuf,
    /// Position of the image's lower left corner.
    #[serde(default)]
    pub origin: [f64; 2],
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slice {
    /// `mask.nii.gz`, relative to the scene file.
    pub file: PathBuf,
    /// Number of the slice along `axis`, from 0.
    pub index: usize,
    #[serde(default)]
    pub axis: crate::grid::Axis,
    /// The scan itself, for densities from grey values.
    #[serde(default)]
    pub grey: Option<PathBuf>,
}

/// Pixels read for [`Geometry::Image`] or [`Geometry::Slice`]: rows from the bottom up, x fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct Bitmap {
    pub n: [usize; 2],
    pub inside: Vec<bool>,
}

impl Geometry {
    /// The points inside, on a grid of `spacing`. `bitmap` holds the pixels of an image or slice.
    pub fn points(&self, spacing: f64, bitmap: Option<&Bitmap>) -> Result<Points> {
        if !(spacing.is_finite() && spacing > 0.0) {
            return Err(Error::setting(
                "grid.spacing",
                format!("expected a positive length, found {spacing}"),
                "give the distance between neighbouring points",
            ));
        }
        match self {
            Geometry::Rectangle(shape) => shape.points(spacing),
            Geometry::Disc(shape) => shape.points(spacing),
            Geometry::Polygon(shape) => shape.points(spacing),
            Geometry::Image(shape) => {
                if let Some(wrong) = shape.origin.iter().find(|v| !v.is_finite()) {
                    return Err(Error::setting(
                        "geometry.image.origin",
                        format!("found {wrong}"),
                        "give finite coordinates",
                    ));
                }
                bitmap_points(shape.origin, spacing, bitmap)
            }
            Geometry::Slice(_) => bitmap_points([0.0; 2], spacing, bitmap),
        }
    }
}

impl Rectangle {
    fn points(&self, spacing: f64) -> Result<Points> {
        let mut n = [0; 2];
        for (n, size) in n.iter_mut().zip(self.size) {
            require_positive("geometry.rectangle.size", size)?;
            let cells = size / spacing;
            let whole = cells.round();
            if !(1.0..1e5).contains(&whole) || (cells - whole).abs() > 1e-6 * whole {
                return Err(Error::setting(
                    "geometry.rectangle.size",
                    format!("{size} is not a whole number of cells of {spacing}"),
                    format!(
                        "the nearest that fits is {}",
                        whole.clamp(1.0, 1e5) * spacing
                    ),
                ));
            }
            *n = whole as usize;
        }
        let shift = if self.nodal { 0.5 * spacing } else { 0.0 };
        let more = usize::from(self.nodal);
        let origin = n.map(|cells| -0.5 * cells as f64 * spacing - shift);
        let n = n.map(|cells| cells + more);
        let mut points = Points::from_box(origin, spacing, n, |_| true);
        points.on_edges = self.nodal;
        Ok(points)
    }
}

impl Disc {
    fn points(&self, spacing: f64) -> Result<Points> {
        require_positive("geometry.disc.radius", self.radius)?;
        let half = (self.radius / spacing).ceil();
        let n = cells_of("geometry.disc.radius", 2.0 * half)?;
        let origin = self.centre.map(|c| c - half * spacing);
        let inside = |p: [f64; 2]| {
            (p[0] - self.centre[0]).powi(2) + (p[1] - self.centre[1]).powi(2)
                < self.radius * self.radius
        };
        Ok(Points::from_box(origin, spacing, [n, n], inside))
    }
}

impl Polygon {
    pub fn contains(&self, p: [f64; 2]) -> bool {
        let round = |h: &[f64; 3]| (p[0] - h[0]).powi(2) + (p[1] - h[1]).powi(2) < h[2] * h[2];
        winds(&self.corners, p)
            && !self.holes.iter().any(|hole| winds(hole, p))
            && !self.round_holes.iter().any(round)
    }

    /// Area of the outline less polygonal holes (round holes not counted), in the scene's unit squared.
    pub fn area(&self) -> f64 {
        let holes: f64 = self.holes.iter().map(|h| shoelace(h).abs()).sum();
        shoelace(&self.corners).abs() - holes
    }

    fn points(&self, spacing: f64) -> Result<Points> {
        if self.corners.len() < 3 || self.corners.iter().flatten().any(|v| !v.is_finite()) {
            return Err(Error::setting(
                "geometry.polygon.corners",
                format!(
                    "expected at least 3 finite corners, found {}",
                    self.corners.len()
                ),
                "list corners as [x, y] pairs, or name a CSV file in geometry.polygon.file",
            ));
        }
        let bound = |a: usize, pick: fn(f64, f64) -> f64| {
            self.corners.iter().map(|c| c[a]).fold(f64::NAN, pick)
        };
        let low = [0, 1].map(|a| (bound(a, f64::min) / spacing + 1e-9).floor());
        let high = [0, 1].map(|a| (bound(a, f64::max) / spacing - 1e-9).ceil());
        let key = "geometry.polygon.corners";
        let n = [
            cells_of(key, high[0] - low[0])?,
            cells_of(key, high[1] - low[1])?,
        ];
        let origin = low.map(|l| l * spacing);
        Ok(Points::from_box(origin, spacing, n, |p| self.contains(p)))
    }
}

fn bitmap_points(origin: [f64; 2], spacing: f64, bitmap: Option<&Bitmap>) -> Result<Points> {
    let Some(bitmap) = bitmap else {
        return Err(Error::setting(
            "geometry",
            "the image of the geometry was not read",
            "check its path",
        ));
    };
    let cells = (0..bitmap.n[1]).flat_map(|j| (0..bitmap.n[0]).map(move |i| [i, j]));
    let inside = cells.filter(|[i, j]| bitmap.inside[j * bitmap.n[0] + i]);
    let cells = inside.map(|[i, j]| [i as i32, j as i32]).collect();
    Ok(Points::from_cells(origin, spacing, cells))
}

fn require_positive(key: &str, value: f64) -> Result<()> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::setting(
        key,
        format!("expected a positive length, found {value}"),
        "give it in the scene's length unit",
    ))
}

fn cells_of(key: &str, cells: f64) -> Result<usize> {
    if (1.0..=20_000.0).contains(&cells) {
        return Ok(cells as usize);
    }
    Err(Error::setting(
        key,
        format!("the outline spans {cells} cells; expected 1 to 20000"),
        "check it against grid.spacing",
    ))
}

/// Whether a point is inside a closed polygon, by the even-odd rule.
pub fn winds(corners: &[[f64; 2]], p: [f64; 2]) -> bool {
    let next = |i: usize| corners[(i + 1) % corners.len()];
    let crosses = |i: usize| {
        let (a, b) = (corners[i], next(i));
        (a[1] > p[1]) != (b[1] > p[1])
            && p[0] < (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]) + a[0]
    };
    (0..corners.len()).filter(|&i| crosses(i)).count() % 2 == 1
}

fn shoelace(corners: &[[f64; 2]]) -> f64 {
    let next = |i: usize| corners[(i + 1) % corners.len()];
    let twice = |i: usize| corners[i][0] * next(i)[1] - next(i)[0] * corners[i][1];
    0.5 * (0..corners.len()).map(twice).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cell counts of the unit disc printed in Diana (2023), figs 34 to 37.
    #[test]
    fn disc_counts_are_the_papers() {
        for (n, count) in [(100.0, 31428), (60.0, 11304), (30.0, 2828)] {
            let disc = Geometry::Disc(Disc {
                centre: [0.0; 2],
                radius: 1.0,
            });
            assert_eq!(disc.points(1.0 / n, None).unwrap().len(), count);
        }
    }

    #[test]
    fn rectangles_refuse_broken_cells() {
        let shape = |size, nodal| Geometry::Rectangle(Rectangle { size, nodal });
        assert_eq!(
            shape([1.0, 0.5], false).points(0.1, None).unwrap().len(),
            50
        );
        assert_eq!(shape([1.0, 0.5], true).points(0.1, None).unwrap().len(), 66);
        let nodal = shape([1.0, 0.5], true).points(0.1, None).unwrap();
        assert!((nodal.position(0)[0] + 0.5).abs() < 1e-12);
        assert!(shape([1.05, 0.5], false).points(0.1, None).is_err());
        assert!(shape([f64::NAN, 0.5], false).points(0.1, None).is_err());
        assert!(shape([1.0, 0.5], false).points(0.0, None).is_err());
    }

    #[test]
    fn polygons_have_holes() {
        let square = |h: f64| vec![[-h, -h], [h, -h], [h, h], [-h, h]];
        let ring = Polygon {
            corners: square(1.0),
            holes: vec![square(0.5)],
            round_holes: vec![[0.75, 0.75, 0.11]],
            file: None,
        };
        assert_eq!(ring.area(), 3.0);
        let points = Geometry::Polygon(ring).points(0.1, None).unwrap();
        // 400 cells, less 100 in the square hole, less the one at (0.75, 0.75) and its 4 neighbours at 0.1.
        assert_eq!(points.len(), 400 - 100 - 5);
    }
}
