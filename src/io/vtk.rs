//! Owns exports for ParaView and OVITO: legacy VTK files, binary (big-endian).

use crate::error::Result;
use crate::io::atomic;
use crate::topology::sites::Sites;
use std::io::Write;
use std::path::Path;

/// A lattice as points (sites, mm) and lines (bonds), with each site's number of bonds and weight.
pub fn write_lattice(path: &Path, sites: &Sites) -> Result<()> {
    atomic::write_with(path, |out| lattice(out, sites))
}

fn lattice(out: &mut impl Write, sites: &Sites) -> std::io::Result<()> {
    let frame = &sites.frame;
    writeln!(out, "# vtk DataFile Version 3.0")?;
    writeln!(
        out,
        "{} lattice, LP {} mm",
        frame.structure.name(),
        frame.lp_mm
    )?;
    writeln!(
        out,
        "BINARY\nDATASET POLYDATA\nPOINTS {} float",
        sites.len()
    )?;
    for &at in &sites.indices {
        for x in frame.position_mm(at) {
            out.write_all(&(x as f32).to_be_bytes())?;
        }
    }
    let bonds = sites.bonds();
    writeln!(out, "\nLINES {bonds} {}", 3 * bonds)?;
    for s in 0..sites.len() {
        let row = sites.neighbours_of(s);
        for &end in row.iter().step_by(2).filter(|&&end| end as usize != s) {
            for v in [2, s as i32, end as i32] {
                out.write_all(&v.to_be_bytes())?;
            }
        }
    }
    writeln!(
        out,
        "\nPOINT_DATA {}\nSCALARS bonds int 1\nLOOKUP_TABLE default",
        sites.len()
    )?;
    for s in 0..sites.len() {
        let count = sites
            .neighbours_of(s)
            .iter()
            .filter(|&&end| end as usize != s)
            .count() as i32;
        out.write_all(&count.to_be_bytes())?;
    }
    writeln!(out, "\nSCALARS weight float 1\nLOOKUP_TABLE default")?;
    for s in 0..sites.len() {
        let weight = sites.weights.as_ref().map_or(1.0, |w| w[s] as f32);
        out.write_all(&weight.to_be_bytes())?;
    }
    writeln!(out)
}
