//! Owns smooth elements as a VTK XML unstructured grid: quadratic tetrahedra, their moduli or fields, binary after the head.

use crate::discretisation::tetrahedra::nodes::Ten;
use crate::error::Result;
use crate::io::atomic;
use crate::physics::tet10::Tet10;
use crate::pipeline::apparent::fields::{MeshArray, MeshFields};
use std::io::{Result as Written, Write};
use std::path::Path;

/// VTK's number of a quadratic tetrahedron, whose nodes come in the order of ours.
const QUADRATIC_TETRA: u8 = 24;

/// Elements with their moduli over the mean.
///
/// # Errors
/// An unwritable file.
pub fn write(path: &Path, model: &Tet10) -> Result<()> {
    let mesh = &model.mesh;
    let factors = (0..mesh.elements.len()).map(|e| model.factor(e) as f32);
    let moduli = MeshArray::new("modulus_factor", 1, factors.collect());
    atomic::write_with(path, |out| {
        fill(out, &mesh.nodes_mm, &mesh.elements, &[], &[moduli])
    })
}

/// Fields of nodes and of elements.
///
/// # Errors
/// An unwritable file.
pub fn write_fields(path: &Path, of: &MeshFields) -> Result<()> {
    atomic::write_with(path, |out| {
        fill(
            out,
            &of.nodes_mm,
            &of.elements,
            &of.of_nodes,
            &of.of_elements,
        )
    })
}

/// The head names where each array begins; each comes after its length in bytes.
fn fill(
    out: &mut impl Write,
    nodes_mm: &[[f64; 3]],
    elements: &[Ten],
    of_nodes: &[MeshArray],
    of_elements: &[MeshArray],
) -> Written<()> {
    let (nodes, count) = (nodes_mm.len(), elements.len());
    let mut at = 0;
    let mut next = |length: usize| {
        let begin = at;
        at += 8 + length;
        begin
    };
    let (points, connectivity) = (next(12 * nodes), next(40 * count));
    let (ends, types) = (next(8 * count), next(count));
    writeln!(
        out,
        r#"<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<UnstructuredGrid><Piece NumberOfPoints="{nodes}" NumberOfCells="{count}">
<Points><DataArray type="Float32" Name="position_mm" NumberOfComponents="3" format="appended" offset="{points}"/></Points>
<Cells>
<DataArray type="Int32" Name="connectivity" format="appended" offset="{connectivity}"/>
<DataArray type="Int64" Name="offsets" format="appended" offset="{ends}"/>
<DataArray type="UInt8" Name="types" format="appended" offset="{types}"/>
</Cells>"#
    )?;
    for (kind, arrays) in [("PointData", of_nodes), ("CellData", of_elements)] {
        writeln!(out, "<{kind}>")?;
        for array in arrays {
            let MeshArray {
                name,
                components,
                values,
            } = array;
            let begin = next(4 * values.len());
            writeln!(
                out,
                r#"<DataArray type="Float32" Name="{name}" NumberOfComponents="{components}" format="appended" offset="{begin}"/>"#
            )?;
        }
        writeln!(out, "</{kind}>")?;
    }
    write!(
        out,
        "</Piece></UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_"
    )?;
    let length = |out: &mut dyn Write, bytes: usize| out.write_all(&(bytes as u64).to_le_bytes());
    length(out, 12 * nodes)?;
    for v in nodes_mm.as_flattened() {
        out.write_all(&(*v as f32).to_le_bytes())?;
    }
    length(out, 40 * count)?;
    for n in elements.as_flattened() {
        out.write_all(&(*n as i32).to_le_bytes())?;
    }
    length(out, 8 * count)?;
    for e in 1..=count {
        out.write_all(&(10 * e as i64).to_le_bytes())?;
    }
    length(out, count)?;
    out.write_all(&vec![QUADRATIC_TETRA; count])?;
    for array in of_nodes.iter().chain(of_elements) {
        length(out, 4 * array.values.len())?;
        for v in &array.values {
            out.write_all(&v.to_le_bytes())?;
        }
    }
    writeln!(out, "\n</AppendedData>\n</VTKFile>")
}
