//! Owns images for ParaView: VTK's XML image data (.vti) with cell data, compressed.

use crate::error::Result;
use crate::format::orient::column_norms;
use crate::grid::Grid;
use crate::io::atomic;
use crate::volume::Volume;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::io::Write;
use std::path::Path;

/// Bytes of one compressed block.
const BLOCK: usize = 1 << 20;

/// One array of an image.
pub struct Array<'a> {
    pub name: &'a str,
    /// In words, kept as a comment.
    pub about: &'a str,
    /// Names of the components; empty for a scalar.
    pub labels: &'static [&'static str],
    pub components: &'a [Volume<f32>],
    /// On the corners of the voxels instead of the voxels.
    pub is_of_nodes: bool,
}

/// Writes arrays on one grid as cells, and corners, of an image at its place in the world.
pub fn write(path: &Path, arrays: &[Array]) -> Result<()> {
    let Some(first) = arrays.first() else {
        return Ok(());
    };
    let corner = usize::from(first.is_of_nodes);
    let volume = &first.components[0];
    let [nx, ny, nz] = volume.grid.n.map(|n| n - corner);
    let [sx, sy, sz] = volume.grid.spacing_mm;
    let (mut origin, direction) = placed(volume.affine, &volume.grid);
    if first.is_of_nodes {
        let rows = volume.affine.unwrap_or_default();
        origin = rows.map(|row| row[3]);
    }
    let list = |v: &[f64]| v.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let extent = format!("0 {nx} 0 {ny} 0 {nz}");
    let mut head = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n\
         <ImageData WholeExtent=\"{extent}\" Origin=\"{}\" Spacing=\"{}\" Direction=\"{}\">\n\
         <Piece Extent=\"{extent}\">\n",
        list(&origin),
        list(&[sx, sy, sz]),
        list(&direction),
    );
    let mut blocks = Vec::new();
    let mut offset = 0;
    for (kind, of_nodes) in [("PointData", true), ("CellData", false)] {
        head += &format!("<{kind}>\n");
        for array in arrays.iter().filter(|a| a.is_of_nodes == of_nodes) {
            let block = compressed(array.components);
            head += &element(array, offset);
            offset += block.len();
            blocks.push(block);
        }
        head += &format!("</{kind}>\n");
    }
    head += "</Piece>\n</ImageData>\n<AppendedData encoding=\"raw\">\n_";
    atomic::write_with(path, |out| {
        out.write_all(head.as_bytes())?;
        blocks.iter().try_for_each(|block| out.write_all(block))?;
        out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
    })
}

/// The head of an array whose data lie at `offset`.
fn element(array: &Array, offset: usize) -> String {
    let names = array.labels.iter().enumerate();
    let names: String = names
        .map(|(i, label)| format!(" ComponentName{i}=\"{label}\""))
        .collect();
    format!(
        "<!-- {}: {} -->\n<DataArray type=\"Float32\" Name=\"{}\" NumberOfComponents=\"{}\"{names} format=\"appended\" offset=\"{offset}\"/>\n",
        array.name,
        array.about,
        array.name,
        array.components.len()
    )
}

/// The outer corner of the first voxel and the axes' directions, row by row.
fn placed(affine: Option<[[f64; 4]; 3]>, grid: &Grid) -> ([f64; 3], [f64; 9]) {
    let Some(rows) = affine else {
        let unit = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        return (grid.spacing_mm.map(|s| -0.5 * s), unit);
    };
    let norms = column_norms(&rows);
    let corner = rows.map(|[x, y, z, o]| o - 0.5 * (x + y + z));
    (
        corner,
        std::array::from_fn(|i| rows[i / 3][i % 3] / norms[i % 3]),
    )
}

/// Number of blocks, their size, the last one's, each one's compressed size; then the blocks. Components vary fastest.
fn compressed(components: &[Volume<f32>]) -> Vec<u8> {
    let values: Vec<&[f32]> = components.iter().map(Volume::as_slice).collect();
    let bytes: Vec<u8> = (0..values[0].len())
        .flat_map(|v| values.iter().map(move |component| component[v]))
        .flat_map(f32::to_le_bytes)
        .collect();
    let blocks: Vec<Vec<u8>> = bytes
        .chunks(BLOCK)
        .map(|chunk| {
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
            encoder.write_all(chunk).expect("memory does not fail");
            encoder.finish().expect("memory does not fail")
        })
        .collect();
    // A last block that is whole counts as none that is partial.
    let mut out = Vec::new();
    let numbers = [blocks.len(), BLOCK, bytes.len() % BLOCK];
    for number in numbers.into_iter().chain(blocks.iter().map(Vec::len)) {
        out.extend((number as u64).to_le_bytes());
    }
    blocks.iter().for_each(|block| out.extend(block));
    out
}
