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

/// Writes volumes on one grid as cells of an image at its place in the world, one array each.
pub fn write(path: &Path, arrays: &[(&str, &Volume<f32>)]) -> Result<()> {
    let Some((_, first)) = arrays.first() else {
        return Ok(());
    };
    let blocks: Vec<Vec<u8>> = arrays.iter().map(|(_, v)| compressed(v)).collect();
    let [nx, ny, nz] = first.grid.n;
    let [sx, sy, sz] = first.grid.spacing_mm;
    let (origin, direction) = placed(first.affine, &first.grid);
    let list = |v: &[f64]| v.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let extent = format!("0 {nx} 0 {ny} 0 {nz}");
    let mut head = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n\
         <ImageData WholeExtent=\"{extent}\" Origin=\"{}\" Spacing=\"{}\" Direction=\"{}\">\n\
         <Component Extent=\"{extent}\">\n<CellData>\n",
        list(&origin),
        list(&[sx, sy, sz]),
        list(&direction),
    );
    let mut offset = 0;
    for ((name, _), block) in arrays.iter().zip(&blocks) {
        head += &format!(
            "<DataArray type=\"Float32\" Name=\"{name}\" format=\"appended\" offset=\"{offset}\"/>\n"
        );
        offset += block.len();
    }
    head += "</CellData>\n</Component>\n</ImageData>\n<AppendedData encoding=\"raw\">\n_";
    atomic::write_with(path, |out| {
        out.write_all(head.as_bytes())?;
        blocks.iter().try_for_each(|block| out.write_all(block))?;
        out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
    })
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

/// Number of blocks, their size, the last one's, each one's compressed size; then the blocks.
fn compressed(volume: &Volume<f32>) -> Vec<u8> {
    let bytes: Vec<u8> = volume
        .as_slice()
        .iter()
        .flat_map(|v| v.to_le_bytes())
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
