//! Owns smooth elements as a VTK XML unstructured grid: quadratic tetrahedra and their moduli, binary after the head.

use crate::error::Result;
use crate::io::atomic;
use crate::physics::tet10::Tet10;
use std::io::Write;
use std::path::Path;

/// VTK's number of a quadratic tetrahedron, whose nodes come in the order of ours.
const QUADRATIC_TETRA: u8 = 24;

pub fn write(path: &Path, model: &Tet10) -> Result<()> {
    let mesh = &model.mesh;
    let (nodes, elements) = (mesh.nodes_mm.len(), mesh.elements.len());
    // Arrays in the order of the head, each after its length.
    let lengths = [
        12 * nodes,
        40 * elements,
        8 * elements,
        elements,
        4 * elements,
    ];
    let mut offsets = [0; 5];
    for i in 1..5 {
        offsets[i] = offsets[i - 1] + 8 + lengths[i - 1];
    }
    let [points, connectivity, ends, types, factors] = offsets;
    atomic::write_with(path, |out| {
        write!(
            out,
            r#"<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<UnstructuredGrid><Piece NumberOfPoints="{nodes}" NumberOfCells="{elements}">
<Points><DataArray type="Float32" Name="position_mm" NumberOfComponents="3" format="appended" offset="{points}"/></Points>
<Cells>
<DataArray type="Int32" Name="connectivity" format="appended" offset="{connectivity}"/>
<DataArray type="Int64" Name="offsets" format="appended" offset="{ends}"/>
<DataArray type="UInt8" Name="types" format="appended" offset="{types}"/>
</Cells>
<CellData><DataArray type="Float32" Name="modulus_factor" format="appended" offset="{factors}"/></CellData>
</Piece></UnstructuredGrid>
<AppendedData encoding="raw">
_"#
        )?;
        let length =
            |out: &mut dyn Write, i: usize| out.write_all(&(lengths[i] as u64).to_le_bytes());
        length(out, 0)?;
        for v in mesh.nodes_mm.as_flattened() {
            out.write_all(&(*v as f32).to_le_bytes())?;
        }
        length(out, 1)?;
        for n in mesh.elements.as_flattened() {
            out.write_all(&(*n as i32).to_le_bytes())?;
        }
        length(out, 2)?;
        for e in 1..=elements {
            out.write_all(&(10 * e as i64).to_le_bytes())?;
        }
        length(out, 3)?;
        out.write_all(&vec![QUADRATIC_TETRA; elements])?;
        length(out, 4)?;
        for e in 0..elements {
            out.write_all(&(model.factor(e) as f32).to_le_bytes())?;
        }
        writeln!(out, "\n</AppendedData>\n</VTKFile>")
    })
}
