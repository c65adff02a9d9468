//! Owns the export of a lattice as a LAMMPS data file (`atom_style bond`).
//!
//! At ν = ¼ a lattice is a plain spring network: per bond `U = (k_s/4) (elongation)²`, which is LAMMPS' harmonic bond
//! `E = K (r − r0)²` with `K = k_s/4`. That is what is written, for E = 1000 MPa; mm, N and N mm, `units lj`.

use crate::error::{Error, Result};
use crate::io::atomic;
use crate::physics::lattice::Moduli;
use crate::topology::sites::Sites;
use std::io::Write;
use std::path::Path;

const YOUNG_MPA: f64 = 1000.0;

/// Atom types: 1 free, 2 in the low grip, 3 in the high grip. Bond types: 1 first shell, 2 second shell.
///
/// # Errors
/// An unwritable file, or a graded lattice, whose bonds all differ.
pub fn write(path: &Path, sites: &Sites) -> Result<()> {
    if sites.weights.is_some() {
        return Err(graded());
    }
    atomic::write_with(path, |out| fill(out, sites))
}

/// Why a graded lattice is not written.
pub fn graded() -> Error {
    Error::setting(
        "--export lammps",
        "a graded lattice has a stiffness of its own on every bond",
        "export firm or floppy lattices",
    )
}

fn fill(out: &mut impl Write, sites: &Sites) -> std::io::Result<()> {
    let frame = &sites.frame;
    let stencil = frame.structure.stencil();
    let moduli =
        Moduli::new(frame.structure, frame.lp_mm, YOUNG_MPA, 0.25).expect("fixed, valid moduli");
    writeln!(
        out,
        "# {} lattice, LP {} mm, E {YOUNG_MPA} MPa, nu 0.25; units lj (mm, N, N mm); atom_style bond\n",
        frame.structure.name(),
        frame.lp_mm
    )?;
    writeln!(
        out,
        "{} atoms\n{} bonds\n3 atom types\n2 bond types\n",
        sites.len(),
        sites.bonds()
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
    for shell in 0..2 {
        let pair = if shell == 0 {
            0
        } else {
            stencil.first_shell_pairs
        };
        let squared: i32 = stencil.pairs[pair].iter().map(|c| c * c).sum();
        let length = f64::from(squared).sqrt() * frame.step_mm;
        writeln!(
            out,
            "{} {:.17e} {length:.17e}",
            shell + 1,
            0.25 * moduli.k[shell]
        )?;
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
    let mut bond = 0;
    for s in 0..sites.len() {
        for (p, ends) in sites.neighbours_of(s).chunks_exact(2).enumerate() {
            // Each bond stands once, at the site it leaves along its pair's direction.
            if ends[0] as usize != s {
                bond += 1;
                let shell = 1 + usize::from(p >= stencil.first_shell_pairs);
                writeln!(out, "{bond} {shell} {} {}", s + 1, ends[0] + 1)?;
            }
        }
    }
    Ok(())
}
