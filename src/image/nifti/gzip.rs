//! Owns compression on all threads: blocks are deflated each on its own and joined to one stream of gzip (RFC 1952), the same
//! on any number of threads.

use flate2::{Compress, Compression, Crc, FlushCompress, Status};
use rayon::prelude::*;
use std::io::{Error, Result, Write};

/// Bytes a block.
const BLOCK: usize = 1 << 20;
/// Blocks in memory at a time.
const AT_ONCE: usize = 16;

/// Writes `parts`, one after the other, as one stream.
pub fn write(out: &mut impl Write, parts: &[&[u8]]) -> Result<()> {
    // Deflate, no name, no time, fastest, unknown system.
    out.write_all(&[0x1F, 0x8B, 8, 0, 0, 0, 0, 0, 4, 255])?;
    let blocks: Vec<&[u8]> = parts.iter().flat_map(|part| part.chunks(BLOCK)).collect();
    let mut sum = Crc::new();
    for some in blocks.chunks(AT_ONCE) {
        let packed: Vec<(Vec<u8>, Crc)> = some
            .par_iter()
            .map(|block| deflated(block))
            .collect::<Result<_>>()?;
        for (bytes, crc) in &packed {
            out.write_all(bytes)?;
            sum.combine(crc);
        }
    }
    // An empty last block ends the stream.
    out.write_all(&[3, 0])?;
    out.write_all(&sum.sum().to_le_bytes())?;
    out.write_all(&sum.amount().to_le_bytes())
}

/// A block that ends at a whole byte, and its checksum.
fn deflated(block: &[u8]) -> Result<(Vec<u8>, Crc)> {
    let mut crc = Crc::new();
    crc.update(block);
    let mut state = Compress::new(Compression::fast(), false);
    let mut out = Vec::with_capacity(block.len() + block.len() / 8 + 1024);
    loop {
        let rest = &block[state.total_in() as usize..];
        let status = state.compress_vec(rest, &mut out, FlushCompress::Sync)?;
        // Room that is left says that all was flushed.
        if state.total_in() as usize == block.len() && out.len() < out.capacity() {
            return Ok((out, crc));
        }
        if !matches!(status, Status::Ok | Status::BufError) {
            return Err(Error::other("the compressor stopped"));
        }
        out.reserve(block.len() / 8 + 1024);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn one_stream_holds_all_parts() {
        let mut state = 1u32;
        let mut noise = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        // Noise, which does not compress, and runs.
        let large: Vec<u8> = (0..3 * BLOCK + 17)
            .map(|i| if i % (3 * BLOCK) < BLOCK { noise() } else { 7 })
            .collect();
        let cases: [Vec<&[u8]>; 4] = [
            vec![b"head", &large],
            vec![],
            vec![b""],
            vec![&large[..BLOCK]],
        ];
        for parts in cases {
            let mut packed = Vec::new();
            write(&mut packed, &parts).unwrap();
            let mut back = Vec::new();
            let mut reader = flate2::read::GzDecoder::new(&packed[..]);
            reader.read_to_end(&mut back).unwrap();
            assert_eq!(back, parts.concat());
        }
    }
}
