//! Owns where lattice sites sit in a specimen and which of them exist: the floppy, firm, connected and weighted rules.

pub(super) mod near_bone;

use crate::discretisation::lattice::stencil::Structure;
use crate::error::{Error, Result};
use crate::grid::{Axis, Grid};
use crate::volume::Volume;
use rayon::prelude::*;

/// Which sites exist, and with what share of their stiffness.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Boundary {
    /// Sites within 1.1 first-neighbour distances of a bone voxel's centre.
    Firm,
    /// Sites whose position lies in a bone voxel.
    Floppy,
    /// SC: a site for each connected component of bone in a cell ([`crate::discretisation::lattice::connected`]).
    Connected,
    /// BCC, FCC: sites weighted by the bone fraction of their cell.
    Weighted,
}

impl Boundary {
    /// The word of settings.
    pub fn name(self) -> &'static str {
        match self {
            Boundary::Firm => "firm",
            Boundary::Floppy => "floppy",
            Boundary::Connected => "connected",
            Boundary::Weighted => "weighted",
        }
    }
}

/// Cells with less bone than this carry no weighted site: they are surface voxels' corners. A choice: their stiffness
/// is below 2 % of a whole site's, and leaving them out keeps the contrast of stiffness, which iterations grow with, below 50.
const LEAST_FRACTION: f64 = 0.02;

/// Places for sites that 32-bit numbers can count.
const MOST_PLACES: f64 = u32::MAX as f64;

fn too_many(lp_mm: f64) -> Error {
    Error::setting(
        "lp",
        format!(
            "a lattice parameter of {lp_mm} mm has more than {MOST_PLACES} places for sites in this specimen, which 32-bit numbers cannot count"
        ),
        "give a larger lattice parameter, or crop the scan",
    )
}

/// Positions of candidate sites: a grid of spacing `step_mm` centred in the volume. Along the load axis the outermost
/// planes lie on (or within half a step of) the faces; sideways each site owns a whole cell.
#[derive(Debug, Clone)]
pub struct Frame {
    pub structure: Structure,
    pub axis: Axis,
    pub lp_mm: f64,
    pub step_mm: f64,
    /// Candidates per direction, padding rings included.
    pub n: [usize; 3],
    /// Padding rings below the first proper site, per direction.
    pub rings: [usize; 3],
    /// Position of the first proper site.
    pub first_mm: [f64; 3],
}

impl Frame {
    /// Places candidates of `structure` over `grid`.
    ///
    /// # Errors
    /// A lattice parameter that is not positive, leaves fewer than two planes or no site sideways, or has too many places.
    pub fn new(
        grid: &Grid,
        structure: Structure,
        lp_mm: f64,
        boundary: Boundary,
        axis: Axis,
        registration_mm: [f64; 3],
    ) -> Result<Self> {
        if !(lp_mm > 0.0 && lp_mm.is_finite()) {
            return Err(Error::setting(
                "lp",
                format!("{lp_mm} mm is not a length"),
                "give lattice parameters in mm, such as 0.06,0.08",
            ));
        }
        let step_mm = lp_mm / structure.steps_per_lp();
        let (mut n, mut rings, mut first_mm) = ([0; 3], [0; 3], [0.0; 3]);
        for a in 0..3 {
            let length = grid.size_mm()[a];
            // User spacings hit exact multiples: 1e-9 keeps rounding from losing a plane.
            let whole = (length / step_mm + 1e-9).floor();
            if whole > f64::from(i32::MAX) / 2.0 {
                return Err(too_many(lp_mm));
            }
            let whole = whole as usize;
            let loaded = a == axis.index();
            let proper = whole + usize::from(loaded);
            let least = if loaded { 2 } else { 1 };
            if proper < least || (structure != Structure::Sc && whole < 2) {
                return Err(Error::setting(
                    "lp",
                    format!(
                        "a lattice parameter of {lp_mm} mm does not fit a specimen of {length:.4} mm along {}",
                        ["x", "y", "z"][a]
                    ),
                    "give a smaller lattice parameter",
                ));
            }
            let span = (proper - 1) as f64 * step_mm;
            first_mm[a] = 0.5 * (length - span) + registration_mm[a];
            rings[a] = match boundary {
                _ if loaded => 0,
                Boundary::Firm => {
                    let bone = [0.5 * grid.spacing_mm[a], length - 0.5 * grid.spacing_mm[a]];
                    let radius = near_bone::radius_mm(structure, lp_mm);
                    let sites = [first_mm[a], first_mm[a] + span];
                    rings_within(radius, bone, sites, step_mm).ok_or_else(|| too_many(lp_mm))?
                }
                // A strip narrower than a cell is left over sideways: its bone also counts.
                Boundary::Connected => 1,
                Boundary::Floppy | Boundary::Weighted => 0,
            };
            n[a] = proper + 2 * rings[a];
        }
        if n.iter().map(|&n| n as f64).product::<f64>() > MOST_PLACES {
            return Err(too_many(lp_mm));
        }
        Ok(Frame {
            structure,
            axis,
            lp_mm,
            step_mm,
            n,
            rings,
            first_mm,
        })
    }

    /// Grid indices of candidate `c`, counted from the first proper site.
    pub fn indices(&self, c: usize) -> [i32; 3] {
        let (i, rest) = (c % self.n[0], c / self.n[0]);
        let (j, k) = (rest % self.n[1], rest / self.n[1]);
        let of = |v: usize, a: usize| v as i32 - self.rings[a] as i32;
        [of(i, 0), of(j, 1), of(k, 2)]
    }

    /// Candidate at grid indices, if within the frame.
    pub fn candidate(&self, indices: [i32; 3]) -> Option<usize> {
        let mut c = [0; 3];
        for a in 0..3 {
            let v = indices[a] + self.rings[a] as i32;
            if v < 0 || v as usize >= self.n[a] {
                return None;
            }
            c[a] = v as usize;
        }
        Some((c[2] * self.n[1] + c[1]) * self.n[0] + c[0])
    }

    pub fn position_mm(&self, indices: [i32; 3]) -> [f64; 3] {
        std::array::from_fn(|a| self.first_mm[a] + f64::from(indices[a]) * self.step_mm)
    }

    pub fn candidates(&self) -> usize {
        self.n.iter().product()
    }

    /// Whether grid indices lie on (or, padded, beyond) an outermost proper plane along direction `c`.
    pub fn on_side(&self, indices: [i32; 3], c: usize) -> bool {
        let proper = self.n[c] as i32 - 2 * self.rings[c] as i32;
        indices[c] <= 0 || indices[c] >= proper - 1
    }

    /// Proper planes along the load axis.
    pub fn planes(&self) -> usize {
        self.n[self.axis.index()]
    }
}

/// Rings of steps beyond the `sites` (first and last position along an axis, mm) that may lie within `radius_mm` of the voxel
/// centres of `bone` (first and last, mm): as many on either side as the side with more needs. None where 32-bit numbers
/// cannot count them.
fn rings_within(radius_mm: f64, bone: [f64; 2], sites: [f64; 2], step_mm: f64) -> Option<usize> {
    let below = sites[0] - (bone[0] - radius_mm);
    let above = (bone[1] + radius_mm) - sites[1];
    let rings = (below.max(above).max(0.0) / step_mm + 1e-9).floor();
    (rings < f64::from(i32::MAX) / 4.0).then_some(rings as usize)
}

/// Weight of every candidate: 0 where no site exists, 1 for firm and floppy sites, the bone fraction for weighted ones.
pub fn site_weights(frame: &Frame, bone: &Volume<u8>, boundary: Boundary) -> Vec<f32> {
    if boundary == Boundary::Firm {
        return near_bone::site_weights(frame, bone);
    }
    let weight = |indices: [i32; 3]| match boundary {
        _ if !frame.structure.allows(indices) => 0.0,
        Boundary::Weighted => {
            let edge = frame.lp_mm * frame.structure.cell_volume().cbrt();
            let w = bone_fraction(bone, frame.position_mm(indices), edge);
            if w > LEAST_FRACTION { w as f32 } else { 0.0 }
        }
        _ => f32::from(in_bone(bone, frame.position_mm(indices))),
    };
    (0..frame.candidates())
        .into_par_iter()
        .map(|c| weight(frame.indices(c)))
        .collect()
}

/// 1 if the voxel that contains the position (or the nearest on the volume's faces) is bone.
fn in_bone(bone: &Volume<u8>, position_mm: [f64; 3]) -> u8 {
    u8::from(bone.as_slice()[bone.grid.index(bone.grid.voxel_at(position_mm))] != 0)
}

/// Share of bone in the cube of edge `edge` around a position, of the part of the cube inside the volume.
fn bone_fraction(bone: &Volume<u8>, position_mm: [f64; 3], edge: f64) -> f64 {
    let (grid, values) = (&bone.grid, bone.as_slice());
    let spans: [Vec<(usize, f64)>; 3] =
        std::array::from_fn(|a| overlaps(position_mm[a], edge, grid.spacing_mm[a], grid.n[a]));
    let (mut bone_volume, mut volume) = (0.0, 0.0);
    for &(k, wz) in &spans[2] {
        for &(j, wy) in &spans[1] {
            let row = grid.index([0, j, k]);
            for &(i, wx) in &spans[0] {
                let w = wx * wy * wz;
                volume += w;
                bone_volume += w * f64::from(u8::from(values[row + i] != 0));
            }
        }
    }
    if volume > 0.0 {
        bone_volume / volume
    } else {
        0.0
    }
}

/// Voxels along one axis that a span of length `edge` around `x` overlaps, with the overlaps' lengths.
pub(super) fn overlaps(x: f64, edge: f64, h: f64, n: usize) -> Vec<(usize, f64)> {
    let (low, high) = (x - 0.5 * edge, x + 0.5 * edge);
    let first = (low / h).floor().max(0.0) as usize;
    let past = ((high / h).ceil().max(0.0) as usize).min(n);
    (first..past)
        .map(|i| (i, (high.min((i + 1) as f64 * h) - low.max(i as f64 * h))))
        .filter(|&(_, w)| w > 1e-12 * h)
        .collect()
}
