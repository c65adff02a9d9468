//! Owns `sites.png`: the sites of the coarsest firm and floppy lattice over the bone.

use crate::discretisation::lattice::sites::Sites;
use crate::draw::map;
use crate::draw::still::sites::{Kind, ShownLattice, SiteColour, lattices};
use crate::error::Result;
use crate::io::own_files::SITES;
use crate::pipeline::lattice::{Boundary, Case};
use crate::volume::Specimen;
use std::path::Path;

/// Draws them, where there are such lattices.
///
/// # Errors
/// An unwritable folder.
pub(super) fn write(dir: &Path, specimen: &Specimen, drawn: &[ShownLattice]) -> Result<()> {
    if drawn.iter().all(|lattice| lattice.kinds.is_empty()) {
        return Ok(());
    }
    map::write_shaded_png(&dir.join(SITES), lattices(&specimen.bone, drawn))
}

/// The firm and the floppy lattice of the first structure that has the largest lattice parameter; firm first, as in the paper.
pub(super) fn coarsest(cases: &[Case]) -> Vec<Case> {
    let drawn = |case: &&Case| [Boundary::Firm, Boundary::Floppy].contains(&case.boundary);
    let Some(first) = cases.iter().find(drawn) else {
        return Vec::new();
    };
    let same = |case: &&Case| case.structure == first.structure && case.lp_mm == first.lp_mm;
    let mut found: Vec<Case> = cases.iter().filter(drawn).filter(same).copied().collect();
    found.sort_by_key(|case| case.boundary != Boundary::Firm);
    found
}

/// The sites of a lattice, by kind.
pub(super) fn shown(case: &Case, sites: &Sites) -> ShownLattice<'static> {
    let (word, kinds) = match case.boundary {
        Boundary::Firm => {
            let kind = |name, colour, is_full| Kind {
                name,
                colour,
                at_mm: places(sites, |site| sites.fully_coordinated(site) == is_full),
            };
            let kinds = vec![
                kind("fully coordinated", SiteColour::Red, true),
                kind("with fewer bonds", SiteColour::Blue, false),
            ];
            ("firm", kinds)
        }
        _ => {
            let all = Kind {
                name: "sites",
                colour: SiteColour::Green,
                at_mm: places(sites, |_| true),
            };
            ("floppy", vec![all])
        }
    };
    ShownLattice {
        name: format!(
            "{word}, {}, LP {} mm",
            case.structure.name().to_uppercase(),
            case.lp_mm
        ),
        lp_mm: case.lp_mm,
        kinds,
    }
}

fn places(sites: &Sites, is_shown: impl Fn(usize) -> bool) -> Vec<[f64; 3]> {
    let shown = (0..sites.len()).filter(|&site| is_shown(site));
    shown
        .map(|site| sites.frame.position_mm(sites.indices[site]))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::lattice::{BoundaryWord, LatticeParams, Structure};

    #[test]
    fn the_coarsest_firm_and_floppy_lattices_are_drawn_firm_first() {
        let params = LatticeParams {
            structure: vec![Structure::Bcc, Structure::Sc],
            ..LatticeParams::default()
        };
        let of = |case: &Case| (case.structure, case.lp_mm, case.boundary);
        let found: Vec<_> = coarsest(&params.cases()).iter().map(of).collect();
        let wanted = [Boundary::Firm, Boundary::Floppy].map(|b| (Structure::Bcc, 0.12, b));
        assert_eq!(found, wanted);
        let connected = LatticeParams {
            boundary: vec![BoundaryWord::Connected],
            ..LatticeParams::default()
        };
        assert!(coarsest(&connected.cases()).is_empty());
    }
}
