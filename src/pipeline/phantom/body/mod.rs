//! Owns analytic bodies: shapes that are known at every point, so that finer voxels show the same body more exactly.

mod foam;
mod frame;
mod lattices;
mod params;
mod plates;
pub mod sample;
mod struts;
mod surfaces;
#[cfg(test)]
mod tests;

pub use params::{BodyKind, BodyParams, Orientation};

use super::PhantomParams;
use super::waves::Numbers;
use frame::{Axes, Vec3};
use lattices::Lattice;
use plates::{Crack, Plates};
use rayon::prelude::*;
use struts::{Strut, Struts};
use surfaces::{Periodic, Surface};

#[derive(Debug, Clone)]
enum Shape {
    Periodic(Periodic),
    Plates(Plates),
    Struts(Box<Struts>),
}

/// A solid, infinite but known about the box only. Positions are in mm from the middle of the box.
#[derive(Debug, Clone)]
pub struct Body {
    shape: Shape,
    axes: Axes,
    /// The surface is where the shape has this value.
    level_mm: f64,
    crack: Option<Crack>,
}

/// Cells along each edge of the box; one point anywhere in each counts the share of bone, in step with no lattice. That is good to
/// 0.0005 of the box.
const FIT_CELLS: u64 = 64;

impl Body {
    /// The body of these settings, of the volume fraction asked for (before breaks and crack) in its box.
    pub fn new(params: &PhantomParams, body: &BodyParams) -> Self {
        let axes = match body.orientation {
            Orientation::Random => Axes::random(Numbers::new(params.seed, 4)),
            Orientation::Tilted { tilt, azimuth } => Axes::tilted(tilt, azimuth),
        };
        let mut made = Body {
            shape: shape(params, body, &axes),
            axes,
            level_mm: 0.0,
            crack: None,
        };
        made.fit(params, body);
        let size = params.grid().size_mm();
        made.crack = (body.crack_mm > 0.0).then(|| {
            Crack::new(
                size,
                body.crack_mm,
                body.crack_share,
                Numbers::new(params.seed, 7),
            )
        });
        made
    }

    /// Negative inside; its size is at most the distance from the surface (mm).
    pub fn value(&self, p: Vec3) -> f64 {
        let shape = match &self.shape {
            Shape::Periodic(periodic) => periodic.value(self.axes.inward(p)),
            Shape::Plates(plates) => plates.value(self.axes.inward(p)),
            Shape::Struts(struts) => struts.value(p),
        };
        let value = shape - self.level_mm;
        match &self.crack {
            Some(crack) => value.max(crack.depth(p)),
            None => value,
        }
    }

    /// Sets the level, or the struts' radius, at which the wanted share of the box is bone.
    fn fit(&mut self, params: &PhantomParams, body: &BodyParams) {
        if let Shape::Plates(plates) = &self.shape {
            self.level_mm = 0.5 * params.bvtv * plates.period_mm;
            return;
        }
        // A new radius changes the fillets too; a fixed number of steps repeats everywhere.
        for _ in 0..5 {
            let level = self.level_of(params);
            let Shape::Struts(struts) = &self.shape else {
                self.level_mm = level;
                return;
            };
            let radius = (struts.radius_mm + level).max(0.2 * struts.radius_mm);
            self.shape = shape_of_struts(params, body, &self.axes, radius, false);
        }
        if let Shape::Struts(struts) = &self.shape {
            let radius = struts.radius_mm;
            self.shape = shape_of_struts(params, body, &self.axes, radius, true);
        }
    }

    /// The level below which the wanted share of evenly spread points lies.
    fn level_of(&self, params: &PhantomParams) -> f64 {
        let size = params.grid().size_mm();
        let within = Numbers::new(params.seed, 9);
        let at = |n: u64, a: usize| {
            let cell = n / FIT_CELLS.pow(a as u32) % FIT_CELLS;
            let along = (cell as f64 + within.uniform(3 * n + a as u64)) / FIT_CELLS as f64;
            (along - 0.5) * size[a]
        };
        let mut values: Vec<f64> = (0..FIT_CELLS.pow(3))
            .into_par_iter()
            .map(|n| self.value([at(n, 0), at(n, 1), at(n, 2)]))
            .collect();
        let wanted = ((params.bvtv * values.len() as f64) as usize).min(values.len() - 1);
        *values.select_nth_unstable_by(wanted, f64::total_cmp).1
    }
}

fn shape(params: &PhantomParams, body: &BodyParams, axes: &Axes) -> Shape {
    let numbers = Numbers::new(params.seed, 5);
    let periodic = |surface, sheet| {
        Shape::Periodic(Periodic {
            surface,
            sheet,
            cell_mm: body.cell_mm,
            shift: std::array::from_fn(|a| numbers.uniform(a as u64)),
        })
    };
    match body.kind {
        BodyKind::GyroidNetwork => periodic(Surface::Gyroid, false),
        BodyKind::GyroidSheet => periodic(Surface::Gyroid, true),
        BodyKind::SchwarzPNetwork => periodic(Surface::SchwarzP, false),
        BodyKind::SchwarzPSheet => periodic(Surface::SchwarzP, true),
        BodyKind::SchwarzDNetwork => periodic(Surface::SchwarzD, false),
        BodyKind::SchwarzDSheet => periodic(Surface::SchwarzD, true),
        BodyKind::Plates => Shape::Plates(Plates {
            period_mm: body.cell_mm,
            shift: numbers.uniform(0),
        }),
        // A first guess at the radius.
        _ => shape_of_struts(params, body, axes, 0.1 * body.cell_mm, false),
    }
}

fn shape_of_struts(
    params: &PhantomParams,
    body: &BodyParams,
    axes: &Axes,
    radius_mm: f64,
    with_breaks: bool,
) -> Shape {
    let numbers = Numbers::new(params.seed, 5);
    let (radii, breaks) = (Numbers::new(params.seed, 6), Numbers::new(params.seed, 8));
    let half_mm = half_of_all(params, body);
    let finish = |name: u64, from: Vec3, to: Vec3| Strut {
        from,
        to,
        radius: 1.0 + body.spread * (2.0 * radii.uniform(name) - 1.0),
        broken: (with_breaks && breaks.uniform(name) < body.broken)
            .then(|| 0.3 + 0.4 * breaks.uniform(name ^ u64::MAX)),
    };
    let lattice = |lattice: Lattice| lattice.struts(body.cell_mm, axes, numbers, half_mm, finish);
    let struts = match body.kind {
        BodyKind::Cubic => lattice(Lattice::Cubic),
        BodyKind::Bcc => lattice(Lattice::Bcc),
        BodyKind::Octet => lattice(Lattice::Octet),
        BodyKind::Kelvin => lattice(Lattice::Kelvin),
        _ => foam::struts(body.cell_mm, numbers, half_mm, finish),
    };
    let shares = [body.fillet, body.broken_gap];
    Shape::Struts(Box::new(Struts::new(struts, radius_mm, shares, half_mm)))
}

/// Half the edges of a box that holds the scan, turned and moved.
fn half_of_all(params: &PhantomParams, body: &BodyParams) -> Vec3 {
    let size = params.grid().size_mm();
    let wide = match body.turn_degrees == 0.0 {
        true => [size[0], size[1]],
        false => [(size[0] * size[0] + size[1] * size[1]).sqrt(); 2],
    };
    let margin = 8.0 * params.spacing_mm;
    let half = [wide[0], wide[1], size[2]];
    std::array::from_fn(|a| 0.5 * half[a] + margin + body.shift_mm[a].abs())
}
