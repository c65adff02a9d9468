//! Owns the export of a lattice as a LAMMPS data file (`atom_style bond`).
//!
//! At ν = ¼ a lattice is a plain spring network: per bond `U = (k_s/4) (elongation)²`, which is LAMMPS' harmonic bond
//! `E = K (r − r0)²` with `K = k_s/4`. Where sites differ, a bond has the mean of its ends' weights, and bonds of about one
//! weight share a type. mm, N and N mm, `units lj`. [`script`] has the steps that LAMMPS then makes.

pub mod script;

use crate::discretisation::lattice::sites::Sites;
use crate::error::{Error, Result};
use crate::export::bins::Bins;
use crate::io::atomic;
use crate::physics::lattice::Moduli;
use std::io::Write;
use std::path::Path;

/// What the bonds of a file are worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tissue {
    /// Of a site of weight 1.
    pub young_mpa: f64,
    /// Different weights of bonds at most.
    pub bins: usize,
}

/// Atom types: 1 free, 2 in the low grip, 3 in the high grip. Bond types: first shell, second shell, of each weight in
/// ascending order. Returns by what share the bond farthest from its type's stiffness is off.
///
/// # Errors
/// An unwritable file, a modulus that is none.
pub fn write(path: &Path, sites: &Sites, tissue: Tissue) -> Result<f64> {
    let frame = &sites.frame;
    let moduli = Moduli::new(frame.structure, frame.lp_mm, tissue.young_mpa, 0.25)?;
    let bonds = bonds(sites);
    let weight = |s: u32| sites.weights.as_ref().map_or(1.0, |w| w[s as usize]);
    let weights: Vec<f64> = bonds
        .iter()
        .map(|bond| 0.5 * (weight(bond.ends[0]) + weight(bond.ends[1])))
        .collect();
    let bins = Bins::of(&weights, tissue.bins.max(1));
    atomic::write_with(path, |out| {
        fill(out, sites, tissue.young_mpa, &moduli, &bonds, &bins)
    })?;
    Ok(bins.worst)
}

/// Why a connected lattice is not written.
pub fn connected() -> Error {
    Error::setting(
        "--export lammps",
        "a connected (graded SC) lattice joins components of bone at one point by springs of no length",
        "export firm or floppy lattices, or BCC",
    )
}

struct Bond {
    shell: usize,
    ends: [u32; 2],
}

/// Each bond once, at the site it leaves along its pair's direction.
fn bonds(sites: &Sites) -> Vec<Bond> {
    let first_shell = sites.frame.structure.stencil().first_shell_pairs;
    let mut bonds = Vec::with_capacity(sites.bonds());
    sites.each_row(|s, row| {
        for (p, ends) in row.chunks_exact(2).enumerate() {
            if ends[0] as usize != s {
                bonds.push(Bond {
                    shell: usize::from(p >= first_shell),
                    ends: [s as u32, ends[0]],
                });
            }
        }
    });
    bonds
}

fn fill(
    out: &mut impl Write,
    sites: &Sites,
    young_mpa: f64,
    moduli: &Moduli,
    bonds: &[Bond],
    bins: &Bins,
) -> std::io::Result<()> {
    let frame = &sites.frame;
    let stencil = frame.structure.stencil();
    writeln!(
        out,
        "# {} lattice, LP {} mm, E {young_mpa} MPa, nu 0.25; units lj (mm, N, N mm); atom_style bond\n",
        frame.structure.name(),
        frame.lp_mm
    )?;
    writeln!(
        out,
        "{} atoms\n{} bonds\n3 atom types\n{} bond types\n",
        sites.len(),
        bonds.len(),
        2 * bins.values.len().max(1)
    )?;
    for (a, name) in ["x", "y", "z"].iter().enumerate() {
        let margin = (frame.rings[a] + 2) as f64 * frame.step_mm;
        let high = frame.first_mm[a] + frame.n[a] as f64 * frame.step_mm + margin;
        writeln!(
            out,
            "{} {high} {name}lo {name}hi",
            frame.first_mm[a] - margin
        )?;
    }
    writeln!(
        out,
        "\nMasses\n\n1 1.0\n2 1.0\n3 1.0\n\nBond Coeffs # harmonic\n"
    )?;
    for (bin, weight) in bins.values.iter().enumerate() {
        for (shell, pair) in [0, stencil.first_shell_pairs].into_iter().enumerate() {
            let squared: i32 = stencil.pairs[pair].iter().map(|c| c * c).sum();
            let length = f64::from(squared).sqrt() * frame.step_mm;
            let stiffness = 0.25 * weight * moduli.k[shell];
            let kind = 1 + 2 * bin + shell;
            writeln!(out, "{kind} {stiffness:.17e} {length:.17e}")?;
        }
    }
    writeln!(out, "\nAtoms # bond\n")?;
    for s in 0..sites.len() {
        let [x, y, z] = frame.position_mm(sites.indices[s]);
        let plane = sites.plane(s);
        let kind =
            1 + i32::from(plane <= sites.grips.low) + 2 * i32::from(plane >= sites.grips.high);
        writeln!(out, "{} 1 {kind} {x:.16} {y:.16} {z:.16}", s + 1)?;
    }
    writeln!(out, "\nBonds\n")?;
    for (b, (bond, &bin)) in bonds.iter().zip(&bins.of).enumerate() {
        let kind = 1 + 2 * bin as usize + bond.shell;
        let [from, to] = bond.ends;
        writeln!(out, "{} {kind} {} {}", b + 1, from + 1, to + 1)?;
    }
    Ok(())
}
