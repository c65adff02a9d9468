//! Owns the lattice stage: from a specimen to the sites of one lattice.

use crate::discretisation::lattice::connected::ConnectedSites;
pub use crate::discretisation::lattice::placement::Boundary;
use crate::discretisation::lattice::placement::{Frame, site_weights};
use crate::discretisation::lattice::sites::{Grips, Sites};
pub use crate::discretisation::lattice::stencil::Structure;
use crate::discretisation::lattice::tissue::scale_by_tissue;
use crate::error::{Error, Result};
use crate::grid::Axis;
use crate::result::settings::{BoundaryRule, CellType};
use crate::volume::Specimen;
use serde::{Deserialize, Serialize};

/// Settings of `lattice`: one lattice per structure × lattice parameter × boundary.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LatticeParams {
    /// The cubic lattices.
    pub structure: Vec<Structure>,
    /// The lattice parameters.
    pub lp_mm: Vec<f64>,
    /// The rules by which sites exist.
    pub boundary: Vec<BoundaryWord>,
    /// Offset of the lattice in mm.
    pub registration_mm: [f64; 3],
}

impl Default for LatticeParams {
    fn default() -> Self {
        LatticeParams {
            structure: vec![Structure::Sc],
            lp_mm: vec![0.06, 0.08, 0.10, 0.12],
            boundary: vec![BoundaryWord::Firm, BoundaryWord::Floppy],
            registration_mm: [0.0; 3],
        }
    }
}

impl LatticeParams {
    /// Refuses what no lattice can be built from.
    pub fn check(&self) -> Result<()> {
        for (key, empty) in [
            ("lattice.structure", self.structure.is_empty()),
            ("lattice.lp_mm", self.lp_mm.is_empty()),
            ("lattice.boundary", self.boundary.is_empty()),
        ] {
            if empty {
                return Err(Error::setting(key, "an empty list", "name at least one"));
            }
        }
        if let Some(lp) = self.lp_mm.iter().find(|lp| !(lp.is_finite() && **lp > 0.0)) {
            return Err(Error::setting(
                "lattice.lp_mm",
                format!("expected lengths in mm above 0, found {lp}"),
                "the paper uses 0.06, 0.08, 0.10, 0.12",
            ));
        }
        for &structure in &self.structure {
            for word in &self.boundary {
                word.of(structure)?;
            }
        }
        if self.registration_mm.iter().any(|r| !r.is_finite()) {
            return Err(Error::setting(
                "lattice.registration_mm",
                "expected three finite lengths in mm",
                "0,0,0 centres the lattice",
            ));
        }
        Ok(())
    }
}

/// A boundary as settings name it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BoundaryWord {
    /// Sites within 1.1 first-neighbour distances of bone.
    Firm,
    /// Sites that lie in a bone voxel.
    Floppy,
    /// SC: a site for each connected component of bone in a cell.
    Connected,
    /// BCC, FCC: sites weighted by the bone fraction of their cell.
    Weighted,
    /// The older word for both: connected on SC, weighted on BCC and FCC.
    Graded,
}

impl BoundaryWord {
    /// The boundary that is meant on a structure.
    ///
    /// # Errors
    /// One that the structure does not have.
    pub fn of(self, structure: Structure) -> Result<Boundary> {
        match (self, structure) {
            (BoundaryWord::Firm, _) => Ok(Boundary::Firm),
            (BoundaryWord::Floppy, _) => Ok(Boundary::Floppy),
            (BoundaryWord::Connected | BoundaryWord::Graded, Structure::Sc) => {
                Ok(Boundary::Connected)
            }
            (BoundaryWord::Weighted | BoundaryWord::Graded, _) if structure != Structure::Sc => {
                Ok(Boundary::Weighted)
            }
            (BoundaryWord::Connected, _) => Err(Error::setting(
                "lattice.boundary",
                format!(
                    "connected is a method of sc lattices: cells of {} lattices overlap",
                    structure.name()
                ),
                "use --structure sc, or weighted (sites weighted by bone fraction) on bcc and fcc",
            )),
            _ => Err(Error::setting(
                "lattice.boundary",
                "weighted sc lattices are refused: sites weighted by bone fraction join struts that do not touch (E_app up to 37 % too high where LP is the strut thickness)",
                "use connected on sc, or weighted on bcc and fcc",
            )),
        }
    }
}

/// One lattice of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// The cubic lattice.
    pub structure: Structure,
    /// The lattice parameter.
    pub lp_mm: f64,
    /// Which sites exist.
    pub boundary: Boundary,
    /// Offset of the lattice along x, y, z.
    pub registration_mm: [f64; 3],
}

impl LatticeParams {
    /// The boundaries of a structure, in the order of their rows.
    fn boundaries(&self, structure: Structure) -> impl Iterator<Item = Boundary> {
        let named = |boundary: &Boundary| {
            let mut words = self.boundary.iter();
            words.any(|word| word.of(structure).is_ok_and(|named| named == *boundary))
        };
        let order = [
            Boundary::Floppy,
            Boundary::Connected,
            Boundary::Weighted,
            Boundary::Firm,
        ];
        order
            .into_iter()
            .filter(named)
            .collect::<Vec<_>>()
            .into_iter()
    }

    /// What the older word `graded` means on these structures, where it could be mistaken.
    pub fn note(&self) -> Option<String> {
        let weighted = |s: &&Structure| **s != Structure::Sc;
        let names: Vec<&str> = self
            .structure
            .iter()
            .filter(weighted)
            .map(|s| s.name())
            .collect();
        (self.boundary.contains(&BoundaryWord::Graded) && !names.is_empty()).then(|| {
            format!(
                "graded on {} is the lattice weighted by bone fraction (--boundary weighted), another method than the connected components of graded on sc (--boundary connected)",
                names.join(" and ")
            )
        })
    }

    /// All lattices of the settings: structures, then lattice parameters from coarse to fine, then boundaries, floppy before
    /// firm.
    pub fn cases(&self) -> Vec<Case> {
        let mut lps = self.lp_mm.clone();
        lps.sort_by(|a, b| b.total_cmp(a));
        let mut cases = Vec::new();
        for &structure in &self.structure {
            for &lp_mm in &lps {
                for boundary in self.boundaries(structure) {
                    let registration_mm = self.registration_mm;
                    cases.push(Case {
                        structure,
                        lp_mm,
                        boundary,
                        registration_mm,
                    });
                }
            }
        }
        cases
    }
}

impl Case {
    /// Part of the names of its files: `sc-firm-0.06`.
    pub fn stem(&self) -> String {
        let boundary = BoundaryRule::from(self.boundary).name();
        format!("{}-{boundary}-{}", self.structure.name(), self.lp_mm)
    }
}

/// Builds one lattice of a specimen: places sites, joins them, drops what has no path to both grips.
///
/// # Errors
/// A lattice parameter or grip that does not fit the specimen.
#[doc(hidden)]
pub fn build(specimen: &Specimen, case: &Case, axis: Axis, grip_mm: f64) -> Result<Sites> {
    build_of(specimen, None, case, axis, grip_mm)
}

/// The same where tissue differs: `tissue` is each voxel's modulus over that of the lattice, not read in pores.
#[doc(hidden)]
pub fn build_of(
    specimen: &Specimen,
    tissue: Option<&[f32]>,
    case: &Case,
    axis: Axis,
    grip_mm: f64,
) -> Result<Sites> {
    let (frame, grips) = place(specimen, case, axis, grip_mm)?;
    let weights = weights(specimen, tissue, case, &frame);
    Ok(Sites::connect(frame, weights, grips))
}

/// Of every candidate of a frame.
fn weights(specimen: &Specimen, tissue: Option<&[f32]>, case: &Case, frame: &Frame) -> Vec<f32> {
    let mut weights = site_weights(frame, &specimen.bone, case.boundary);
    if let Some(tissue) = tissue {
        scale_by_tissue(frame, &specimen.bone, tissue, &mut weights);
    }
    weights
}

/// What each site of a lattice takes of `tissue`, a value per voxel, times its weight: as its springs are made by [`build_of`].
#[doc(hidden)]
pub fn site_values(specimen: &Specimen, tissue: &[f32], case: &Case, sites: &Sites) -> Vec<f64> {
    let frame = &sites.frame;
    let weights = weights(specimen, Some(tissue), case, frame);
    let value = |at: &[i32; 3]| frame.candidate(*at).map_or(0.0, |c| f64::from(weights[c]));
    sites.indices.iter().map(value).collect()
}

/// [`build`] for a connected lattice: a site for each connected component of bone in a cell.
///
/// # Errors
/// As [`build`].
#[doc(hidden)]
pub fn build_connected(
    specimen: &Specimen,
    case: &Case,
    axis: Axis,
    grip_mm: f64,
) -> Result<ConnectedSites> {
    let lp = case.lp_mm;
    let wrapped = Case {
        // Shifts by whole cells change nothing, but would leave the bone on one side without cells.
        registration_mm: case.registration_mm.map(|r| r - lp * (r / lp).round()),
        ..*case
    };
    let (frame, grips) = place(specimen, &wrapped, axis, grip_mm)?;
    Ok(ConnectedSites::connect(frame, &specimen.bone, grips))
}

#[cfg(test)]
thread_local! {
    /// How many lattices this thread has placed.
    pub static PLACED: std::cell::Cell<usize> = const { std::cell::Cell::new(0) };
}

fn place(specimen: &Specimen, case: &Case, axis: Axis, grip_mm: f64) -> Result<(Frame, Grips)> {
    #[cfg(test)]
    PLACED.set(PLACED.get() + 1);
    let frame = Frame::new(
        &specimen.bone.grid,
        case.structure,
        case.lp_mm,
        case.boundary,
        axis,
        case.registration_mm,
    )?;
    let length = specimen.length_mm(axis);
    let grips = Grips::new(&frame, length, grip_mm).ok_or_else(|| {
        Error::setting(
            "grip_mm",
            format!(
                "grips of {grip_mm} mm leave nothing free between them: {length:.4} mm long at lp {} mm",
                case.lp_mm
            ),
            "give a thinner grip or a smaller lattice parameter",
        )
    })?;
    Ok((frame, grips))
}

/// What a lattice is made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LatticeSummary {
    /// The cubic lattice.
    pub structure: Structure,
    /// Which sites exist.
    pub boundary: BoundaryRule,
    /// The lattice parameter.
    pub lp_mm: f64,
    /// Sites that carry load.
    pub sites: usize,
    /// Bonds between them, each counted once.
    pub bonds: usize,
    /// Sites with all bonds of the structure; on the loaded faces all that stay inside the volume.
    pub fully_coordinated_sites: usize,
    /// Sites without a path of bonds to both grips.
    pub dropped_sites: usize,
    /// Volume of the sites' cells (connected, weighted: of their bone) over TV.
    pub lattice_bv_tv: f64,
}

/// The counts of a lattice of sites.
#[doc(hidden)]
pub fn summarise(specimen: &Specimen, case: &Case, sites: &Sites) -> LatticeSummary {
    LatticeSummary {
        structure: case.structure,
        boundary: case.boundary.into(),
        lp_mm: case.lp_mm,
        sites: sites.len(),
        bonds: sites.bonds(),
        fully_coordinated_sites: (0..sites.len())
            .filter(|&s| sites.fully_coordinated(s))
            .count(),
        dropped_sites: sites.dropped,
        lattice_bv_tv: sites.volume_mm3() / specimen.tv_mm3,
    }
}

/// [`summarise`] for a connected lattice. Fully coordinated are those with a neighbour along every bond.
#[doc(hidden)]
pub fn summarise_connected(
    specimen: &Specimen,
    case: &Case,
    sites: &ConnectedSites,
) -> LatticeSummary {
    let directions = case.structure.stencil().coordination();
    let whole = |s: &usize| {
        let mut met = vec![false; directions];
        sites.bonds.of(*s).for_each(|(_, b, _)| met[b] = true);
        met.into_iter().all(|met| met)
    };
    LatticeSummary {
        structure: case.structure,
        boundary: case.boundary.into(),
        lp_mm: case.lp_mm,
        sites: sites.len(),
        bonds: sites.pairs().count(),
        fully_coordinated_sites: (0..sites.len()).filter(whole).count(),
        dropped_sites: sites.dropped,
        lattice_bv_tv: sites.bone_mm3() / specimen.tv_mm3,
    }
}

impl LatticeSummary {
    /// One line for a person.
    pub fn in_words(&self) -> String {
        format!(
            "{} {:<9} {:>6} mm  {:>9} sites  {:>10} bonds  {:>9} fully coordinated  {:>6} dropped  lattice BV/TV {:.4}",
            self.structure.name(),
            self.boundary.method_name(CellType::Lattice(self.structure)),
            self.lp_mm,
            self.sites,
            self.bonds,
            self.fully_coordinated_sites,
            self.dropped_sites,
            self.lattice_bv_tv,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn params(structure: &[Structure], boundary: &[BoundaryWord]) -> LatticeParams {
        LatticeParams {
            structure: structure.to_vec(),
            lp_mm: vec![0.1],
            boundary: boundary.to_vec(),
            ..LatticeParams::default()
        }
    }

    #[test]
    fn the_older_word_means_connected_on_sc_and_weighted_elsewhere() {
        use BoundaryWord::{Connected, Graded, Weighted};
        let graded = params(&Structure::ALL, &[Graded]);
        graded.check().unwrap();
        let meant: Vec<Boundary> = graded.cases().iter().map(|case| case.boundary).collect();
        let wanted = [Boundary::Connected, Boundary::Weighted, Boundary::Weighted];
        assert_eq!(meant, wanted);
        assert!(graded.note().unwrap().contains("bcc and fcc"));
        assert_eq!(params(&[Structure::Sc], &[Graded]).note(), None);
        // Named twice, solved once; files say the older word.
        let twice = params(&[Structure::Sc], &[Connected, Graded]).cases();
        assert_eq!(twice, params(&[Structure::Sc], &[Graded]).cases());
        assert_eq!(twice[0].stem(), "sc-graded-0.1");
        assert_eq!(
            params(&[Structure::Bcc], &[Weighted]).cases()[0].stem(),
            "bcc-graded-0.1"
        );
    }

    #[test]
    fn a_boundary_that_a_structure_does_not_have_is_refused() {
        let refused = |structure, word| {
            let words = params(&[structure], &[BoundaryWord::Firm, word]).check();
            words.unwrap_err().to_string()
        };
        let words = refused(Structure::Bcc, BoundaryWord::Connected);
        assert!(
            words.contains("weighted") && words.contains("bcc"),
            "{words}"
        );
        let words = refused(Structure::Sc, BoundaryWord::Weighted);
        assert!(words.contains("use connected on sc"), "{words}");
    }
}
