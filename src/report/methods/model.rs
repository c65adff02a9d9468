//! Owns what a methods section says of models and tissue.

use super::Answered;
use super::words::{by_scan, list, scans, setting, settings, size};
use crate::discretisation::lattice::stencil::Structure;
use crate::physics::hex8::element::{FULL_POISSON, MEAN_POISSON};
use crate::physics::material::formula;
use crate::report::{Report, distinct};
use crate::result::condition::{Condition, Tissue};
use crate::result::row::Row;
use crate::result::settings::load_steps::LoadSteps;
use crate::result::settings::{BoundaryRule, CellType, Elements, Method};

/// One sentence or more for each kind of model that answers.
pub fn text(report: &Report, answered: &[Answered]) -> String {
    let kind = |a: &Answered| {
        let key = &a.row.key;
        (key.method, key.structure, key.boundary, key.elements)
    };
    // What joins nothing was not solved, unless nothing was.
    let loaded: Vec<&Answered> = answered
        .iter()
        .filter(|a| !a.row.is_disconnected())
        .collect();
    let of_models: Vec<&Answered> = match loaded.is_empty() {
        true => answered.iter().collect(),
        false => loaded,
    };
    let kinds = distinct(of_models.iter().map(|a| kind(a)));
    let mut text = String::new();
    for k in &kinds {
        let of: Vec<&&Answered> = of_models.iter().filter(|a| kind(a) == *k).collect();
        let rows: Vec<&Row> = of.iter().map(|a| a.row).collect();
        if kinds.len() > 1 {
            let names: Vec<&str> = of.iter().map(|a| a.line.scan.as_str()).collect();
            text += &format!("Of {}: ", scans(&names));
        }
        text += &model(report, &rows);
        text.push(' ');
    }
    text += &other_sizes(report, answered);
    if rows_of_others(report, answered) {
        text += "Results of further models are in results.csv; they are not the answers described here.";
    }
    text.trim_end().to_owned()
}

/// Further sizes that the models of the answers were solved with; empty where there are none.
fn other_sizes(report: &Report, answered: &[Answered]) -> String {
    let model = |row: &Row| {
        let key = &row.key;
        (key.method, key.structure, key.boundary, key.elements)
    };
    let is_other = |row: &&Row| {
        let own = answered.iter().find(|a| a.row.key.scan == row.key.scan);
        own.is_some_and(|a| {
            model(a.row) == model(row)
                && a.row.key.without_discretisation() == row.key.without_discretisation()
                && a.row.key.lp_mm != row.key.lp_mm
        })
    };
    let sizes = report.rows.iter().filter(is_other);
    let sizes = settings(sizes.map(|row| size(row.key.lp_mm)));
    match sizes.is_empty() {
        true => String::new(),
        false => format!(
            "The same model was also solved with {sizes} mm; of these solves the converged one with the smallest stated error is the answer. "
        ),
    }
}

/// Whether rows of the scans stand for other models than those that answer, or lead to them.
fn rows_of_others(report: &Report, answered: &[Answered]) -> bool {
    report.rows.iter().any(|row| {
        let is_own = |a: &Answered| {
            let (own, key) = (&a.row.key, &row.key);
            own.method == key.method
                && own.structure == key.structure
                && (own.boundary.is_some_and(BoundaryRule::is_derived)
                    || own.boundary == key.boundary)
        };
        answered.iter().any(|a| a.row.key.scan == row.key.scan) && !answered.iter().any(is_own)
    })
}

/// The model of rows that differ in scan and size only.
fn model(report: &Report, rows: &[&Row]) -> String {
    let key = &rows[0].key;
    let of_scans = |what: &str| {
        let says = |row: &&Row| Some(format!("{what} was {} mm", setting(size(row.key.lp_mm))));
        by_scan(rows, |row| &row.key.scan, says)
    };
    match (key.method, key.boundary) {
        (Method::Lattice, Some(boundary)) => lattice(report, rows, boundary),
        (Method::VoxelFe, boundary) => {
            let dilatation = integration(rows[0].key.poisson);
            let limit = match boundary {
                Some(BoundaryRule::Extrapolated) => {
                    format!(
                        " E_app was extrapolated to elements of size zero from {} mm.",
                        behind(report, rows)
                    )
                }
                _ => String::new(),
            };
            format!(
                "{}{} {dilatation}{limit}",
                bricks(key.elements),
                of_scans("The edge of an element")
            )
        }
        (Method::GeometryFe, _) => format!(
            "{}{}",
            tetrahedra(key.elements),
            of_scans("The edge of the cells that the elements were made in")
        ),
        (method, _) => format!(
            "Bone was represented by the method {}.{}",
            method.name(),
            of_scans("The size of a cell")
        ),
    }
}

fn integration(poisson: f64) -> &'static str {
    match poisson {
        nu if nu <= FULL_POISSON => "Elements were fully integrated.",
        nu if nu >= MEAN_POISSON => "The dilatation was averaged over each element.",
        _ => "Elements were a blend of full integration and mean dilatation.",
    }
}

fn bricks(elements: Option<Elements>) -> &'static str {
    match elements {
        None | Some(Elements::Voxels) => {
            "Each bone voxel became one eight-node hexahedral element."
        }
        Some(Elements::InterpolatedGrey) => {
            "Grey values were interpolated on a grid finer than the scan's and thresholded again; each cell of bone became one eight-node hexahedral element."
        }
        Some(Elements::SmoothedGrey) => {
            "Grey values were smoothed once more and thresholded again; each bone voxel became one eight-node hexahedral element."
        }
        Some(Elements::SplitVoxels) => {
            "Each bone voxel of the mask was split into equal eight-node hexahedral elements."
        }
        Some(Elements::BlockMeans) => {
            "Blocks of voxels were averaged and thresholded; each block of bone became one eight-node hexahedral element."
        }
        Some(Elements::BoneFractions) => {
            "Each block of voxels became one eight-node hexahedral element, with the modulus of the tissue times its bone fraction."
        }
        Some(Elements::SmoothGrey | Elements::SmoothDeblurred | Elements::SmoothMask) => {
            "Bone became eight-node hexahedral elements."
        }
    }
}

fn tetrahedra(elements: Option<Elements>) -> &'static str {
    match elements {
        Some(Elements::SmoothMask) => {
            "The surface of bone was that of the smoothed mask; the inside was filled with ten-node tetrahedral elements."
        }
        Some(Elements::SmoothDeblurred) => {
            "The surface of bone was where the interpolated grey values, corrected for the blur of the image, cross the threshold; the inside was filled with ten-node tetrahedral elements."
        }
        _ => {
            "The surface of bone was where the interpolated grey values cross the threshold; the inside was filled with ten-node tetrahedral elements."
        }
    }
}

fn lattice(report: &Report, rows: &[&Row], boundary: BoundaryRule) -> String {
    let structure = rows[0].key.structure;
    let name = match structure {
        CellType::Lattice(Structure::Sc) => "simple cubic",
        CellType::Lattice(Structure::Bcc) => "body-centred cubic",
        CellType::Lattice(Structure::Fcc) => "face-centred cubic",
        CellType::Hex8 | CellType::Tet10 => structure.name(),
    };
    let lattices = match boundary {
        BoundaryRule::Extrapolated => format!("lattice parameters of {} mm", behind(report, rows)),
        _ => format!(
            "a lattice parameter of {} mm",
            settings(rows.iter().map(|row| size(row.key.lp_mm)))
        ),
    };
    let thickness = rows.iter().filter_map(|row| row.marks.mean_thickness_mm);
    let thickness: Vec<f64> = thickness.collect();
    let struts = match super::words::mean_and_range(&thickness, "mm") {
        Some(words) => format!(" (strut thickness 2 BV/BS: {words})"),
        None => String::new(),
    };
    format!(
        "Bone was represented by {name} lattices of material points with {lattices}{struts}. Points interact with their first and second neighbours, and their volumetric energy is summed over each shell of neighbours separately (Chen and Liu 2016). {}",
        rule(boundary, structure)
    )
}

fn rule(boundary: BoundaryRule, structure: CellType) -> &'static str {
    let connected = structure == CellType::Lattice(Structure::Sc);
    match boundary {
        BoundaryRule::Floppy => "Points lie in bone only (floppy boundary, Zojaji et al. 2024).",
        BoundaryRule::Firm => {
            "Bone was padded by one layer of points, and the modulus follows from the stress of the fully coordinated points (firm boundary, Zojaji et al. 2024)."
        }
        BoundaryRule::Ffb => {
            "The modulus is the mean of that of points in bone only (floppy boundary) and that of bone padded by one layer of points (firm boundary, from the stress of its fully coordinated points), at one lattice parameter (FFB, Zojaji et al. 2024)."
        }
        BoundaryRule::Graded if connected => {
            "One point represents each connected component of bone in a cell of the lattice (connected boundary)."
        }
        BoundaryRule::Graded => {
            "The energy of a point is weighted by the bone fraction of its cell (weighted boundary)."
        }
        BoundaryRule::Extrapolated if connected => {
            "One point represents each connected component of bone in a cell of the lattice (connected boundary). E_app was extrapolated to a lattice parameter of zero."
        }
        BoundaryRule::Extrapolated => {
            "The energy of a point is weighted by the bone fraction of its cell (weighted boundary). E_app was extrapolated to a lattice parameter of zero."
        }
    }
}

/// Sizes of the solves that a limit follows from.
fn behind(report: &Report, rows: &[&Row]) -> String {
    let leads = |row: &&Row| {
        let alike = |limit: &&Row| {
            limit.key.without_discretisation() == row.key.without_discretisation()
                && limit.key.method == row.key.method
                && limit.key.structure == row.key.structure
        };
        let lattice = matches!(row.key.boundary, None | Some(BoundaryRule::Graded));
        lattice && row.key.elements != Some(Elements::SmoothedGrey) && rows.iter().any(alike)
    };
    let sizes = distinct(
        report
            .rows
            .iter()
            .filter(leads)
            .map(|row| setting(size(row.key.lp_mm))),
    );
    list(&sizes)
}

/// The tissue: elastic constants, law, yield.
pub fn tissue(condition: &Condition, answered: &[Answered]) -> String {
    let nu = setting(condition.poisson);
    let mut text = match &condition.tissue {
        Tissue::Uniform(young) => format!(
            "Bone tissue was isotropic and linear elastic, with a Young's modulus of {} MPa and a Poisson's ratio of {nu} everywhere.",
            setting(*young)
        ),
        Tissue::Law(law) => format!(
            "Bone tissue was isotropic and linear elastic; its Young's modulus in MPa followed the law {} from voxel to voxel, with a Poisson's ratio of {nu} where the law gives none.",
            formula(law)
        ),
    };
    let yields = distinct(
        answered
            .iter()
            .filter_map(|a| Some((a.row.key.plasticity.clone()?, a.row.key.steps))),
    );
    for (law, steps) in yields {
        text = text.replacen("linear elastic", "elastic up to yield", 1);
        text += &format!(" It yielded by the law {law} (stresses in MPa).");
        if let Some(steps) = steps {
            let steps = match steps {
                LoadSteps::Even(steps) => format!("{steps} even steps"),
                LoadSteps::Adaptive(1) => {
                    "steps whose length followed the stress–strain curve".to_owned()
                }
                LoadSteps::Adaptive(n) => {
                    format!("steps whose length followed the stress–strain curve, divided by {n}")
                }
            };
            text += &format!(" The load was applied in {steps}; a step that failed was halved.");
        }
    }
    text
}

/// What a paper must add on the tissue.
pub fn source_of(condition: &Condition) -> Option<String> {
    match &condition.tissue {
        Tissue::Law(law) => Some(format!("The source of the law {law}, and of the calibration of densities.")),
        Tissue::Uniform(young) if *young == crate::result::condition::DEFAULT_YOUNG_MPA => Some(
            "The tissue modulus of 1000 MPa is the program's default, not a measurement: give moduli as a share of it, or solve with a value from the literature.".to_owned(),
        ),
        Tissue::Uniform(young) => Some(format!("The source of the tissue modulus of {} MPa.", setting(*young))),
    }
}
