//! Owns lattices for ParaView and OVITO, plain or with their fields: legacy VTK files, binary (big-endian).

use crate::discretisation::lattice::connected::ConnectedSites;
use crate::discretisation::lattice::placement::Frame;
use crate::discretisation::lattice::sites::Sites;
use crate::error::Result;
use crate::io::atomic;
use crate::pipeline::apparent::fields::SiteFields;
use std::io::Write;
use std::path::Path;

/// A lattice as points (sites, mm) and lines (bonds), with each site's number of bonds and weight.
pub fn write_lattice(path: &Path, sites: &Sites) -> Result<()> {
    let mut bonds = Vec::with_capacity(sites.bonds());
    sites.each_row(|s, row| {
        let ends = row.iter().step_by(2);
        bonds.extend(
            ends.filter(|&&end| end as usize != s)
                .map(|&end| [s as u32, end]),
        );
    });
    let weights: Vec<f32> = match &sites.weights {
        Some(weights) => weights.iter().map(|&w| w as f32).collect(),
        None => vec![1.0; sites.len()],
    };
    write(path, &sites.frame, &sites.indices, &bonds, &weights)
}

/// [`write_lattice`] for a connected lattice: the weight is a component's bone fraction. Components of one cell lie at one
/// point.
pub fn write_connected(path: &Path, sites: &ConnectedSites) -> Result<()> {
    let bonds: Vec<[u32; 2]> = sites.pairs().map(|(a, b)| [a, b]).collect();
    write(path, &sites.frame, &sites.indices, &bonds, &sites.fractions)
}

/// Fields of a solved lattice, as points with values: mm and MPa.
pub fn write_fields(path: &Path, title: &str, fields: &SiteFields) -> Result<()> {
    let sites = fields.at_mm.len();
    let scalars = [("sed_mpa", &fields.sed_mpa), ("fraction", &fields.fraction)];
    atomic::write_with(path, |out| {
        writeln!(out, "# vtk DataFile Version 3.0\n{title}")?;
        writeln!(out, "BINARY\nDATASET POLYDATA\nPOINTS {sites} float")?;
        write_floats(out, fields.at_mm.as_flattened())?;
        // Viewers show points only as vertices.
        writeln!(out, "\nVERTICES {sites} {}", 2 * sites)?;
        for site in 0..sites as i32 {
            out.write_all(&1i32.to_be_bytes())?;
            out.write_all(&site.to_be_bytes())?;
        }
        writeln!(out, "\nPOINT_DATA {sites}")?;
        let vectors = [
            ("displacement_mm", &fields.displacement_mm),
            ("nodal_force_n", &fields.force_n),
        ];
        for (name, values) in vectors {
            if let Some(values) = values {
                writeln!(out, "VECTORS {name} float")?;
                write_floats(out, values.as_flattened())?;
                writeln!(out)?;
            }
        }
        for (name, values) in scalars {
            if let Some(values) = values {
                writeln!(out, "SCALARS {name} float 1\nLOOKUP_TABLE default")?;
                write_floats(out, values)?;
                writeln!(out)?;
            }
        }
        Ok(())
    })
}

fn write_floats(out: &mut impl Write, values: &[f64]) -> std::io::Result<()> {
    values
        .iter()
        .try_for_each(|v| out.write_all(&(*v as f32).to_be_bytes()))
}

fn write(
    path: &Path,
    frame: &Frame,
    indices: &[[i32; 3]],
    bonds: &[[u32; 2]],
    weights: &[f32],
) -> Result<()> {
    let mut counts = vec![0i32; indices.len()];
    bonds
        .iter()
        .flatten()
        .for_each(|&end| counts[end as usize] += 1);
    atomic::write_with(path, |out| {
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
            indices.len()
        )?;
        for &at in indices {
            for x in frame.position_mm(at) {
                out.write_all(&(x as f32).to_be_bytes())?;
            }
        }
        writeln!(out, "\nLINES {} {}", bonds.len(), 3 * bonds.len())?;
        for [a, b] in bonds {
            for v in [2, *a as i32, *b as i32] {
                out.write_all(&v.to_be_bytes())?;
            }
        }
        writeln!(
            out,
            "\nPOINT_DATA {}\nSCALARS bonds int 1\nLOOKUP_TABLE default",
            indices.len()
        )?;
        for count in counts {
            out.write_all(&count.to_be_bytes())?;
        }
        writeln!(out, "\nSCALARS weight float 1\nLOOKUP_TABLE default")?;
        for weight in weights {
            out.write_all(&weight.to_be_bytes())?;
        }
        writeln!(out)
    })
}
