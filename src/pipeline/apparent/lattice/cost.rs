//! Owns how much memory and time lattices take, from the bone before their solve.
//!
//! Memory goes with what is kept a site (vectors, neighbours, diagonal) and with the boxes of multigrid's aggregates. The
//! factors are fits to the program's own peaks, within 15 % on twelve lattices of all kinds (`cargo bench --bench memory`
//! prints peaks and estimates, `cargo test --release -- --ignored memory_is` holds eight whole commands to them).

use crate::discretisation::lattice::connected::ConnectedSites;
use crate::discretisation::lattice::sites::Sites;
use crate::pipeline::apparent::discretisation::{ASSUMED_BONE, Cost, Known, Resolution};
use crate::pipeline::apparent::lattice::thin;
use crate::pipeline::apparent::tissue::Tissue;
use crate::pipeline::lattice::{Boundary, Case};
use crate::solver::amg::AmgParams;
use crate::solver::direct::fill::Order;
use crate::volume::Specimen;
use std::collections::HashSet;

/// Bytes a site and a box of multigrid's, and a site of connected components, whose bonds have shares.
const SITE: f64 = 115.0;
const SITE_BOX: f64 = 2500.0;
const COMPONENT: f64 = 360.0;

/// Bytes of a thin lattice's factor a block of nine values, and of the matrix that it is made from, a block.
const FACTOR_BLOCK: f64 = 100.0;
const MATRIX_BLOCK: f64 = 150.0;

/// Bytes more a site of a factor of its own, in both precisions, and of a diagonal block that few others have.
const WEIGHTED: f64 = 36.0;

/// Bytes per site before the bone is known, and per place at which a site could be while they are chosen.
const BYTES_PER_SITE: f64 = 260.0;
const BYTES_PER_PLACE: f64 = 4.5;

/// The least and the most that a site takes (solid bone; sheets one site thick).
const LEAST_PER_SITE: f64 = 115.0;
const MOST_PER_SITE: f64 = 430.0;

/// Seconds per site on two cores: 0.55 s for 120 096 sites.
const S_PER_SITE: f64 = 5e-6;

/// What a solve takes.
pub fn of(case: &Case, known: Known) -> Cost {
    let cell_mm3 = case.structure.cell_volume() * case.lp_mm.powi(3);
    let volume_mm3 = match known {
        Known::Header { volume_mm3, .. } => volume_mm3,
        Known::Bone(p) => Some(p.specimen.bone.grid.size_mm().iter().product()),
    };
    let sites = volume_mm3.map(|volume| ASSUMED_BONE * volume / cell_mm3);
    let bytes = match known {
        Known::Header { .. } => [sites.unwrap_or(0.0) * BYTES_PER_SITE; 2],
        Known::Bone(prepared) => bounds(prepared.specimen, case),
    };
    Cost {
        bytes,
        time_s: sites.map(|sites| sites * S_PER_SITE),
        resolution: Resolution::LatticeParameter(case.lp_mm),
    }
}

/// Bytes at the least and at the most, without building the lattice.
fn bounds(specimen: &Specimen, case: &Case) -> [f64; 2] {
    let step = case.lp_mm / case.structure.steps_per_lp();
    let cell = case.structure.cell_volume() * case.lp_mm.powi(3);
    let places = specimen.tv_mm3 / step.powi(3) * BYTES_PER_PLACE;
    let solid = specimen.bv_mm3() / cell;
    // Where little of a place's cell, or only its neighbours', must be bone, any place can be a site.
    let most = match case.boundary {
        Boundary::Floppy => 1.2 * solid,
        Boundary::Firm | Boundary::Connected | Boundary::Weighted => specimen.tv_mm3 / cell,
    };
    [
        places.max(LEAST_PER_SITE * solid),
        places + MOST_PER_SITE * most,
    ]
}

/// Bytes of the solve of a lattice of sites in this tissue.
pub fn of_sites(sites: &Sites, tissue: &Tissue) -> f64 {
    let mut site = SITE;
    if sites.weights.is_some() {
        site += WEIGHTED;
    }
    if matches!(tissue, Tissue::Mixed(mixed) if mixed.poissons.len() > 1) {
        site += WEIGHTED;
    }
    let preconditioner = match thin::factor_order(sites) {
        Some(order) => factor(sites, &order),
        None => boxes(sites) as f64 * SITE_BOX,
    };
    sites.len() as f64 * site + preconditioner
}

/// Bytes of the factor of a thin lattice while it is made: its blocks, and the bonds of the matrix in both directions.
fn factor(sites: &Sites, order: &Order) -> f64 {
    order.blocks as f64 * FACTOR_BLOCK + 2.0 * sites.bonds() as f64 * MATRIX_BLOCK
}

/// Bytes of the solve of a lattice of connected components.
pub fn of_components(sites: &ConnectedSites) -> f64 {
    sites.len() as f64 * COMPONENT
}

/// Multigrid's boxes that hold sites.
fn boxes(sites: &Sites) -> usize {
    let edges = AmgParams::lattice(sites.frame.lp_mm).box_mm;
    let of = |at: &[i32; 3]| {
        let x = sites.frame.position_mm(*at);
        [0, 1, 2].map(|a| (x[a] / edges[a]).floor() as i32)
    };
    let held: HashSet<[i32; 3]> = sites.indices.iter().map(of).collect();
    held.len()
}
