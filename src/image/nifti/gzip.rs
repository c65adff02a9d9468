//! Owns compression on all threads: blocks are deflated each on its own and joined to one stream of gzip (RFC 1952), the same
//! on any number of threads. Noise, which hardly shrinks, is stored as it is: a tenth of the time for a twentieth of the size.

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

/// Bytes from the middle of a block that show whether it shrinks.
const PROBE: usize = 1 << 15;
/// A block that keeps more than this share of its size is stored.
const WORTHWHILE: f64 = 0.85;

/// How hard to try: a part of the block says.
fn level(block: &[u8]) -> Result<Compression> {
    let start = block.len().saturating_sub(PROBE) / 2;
    let probe = &block[start..block.len().min(start + PROBE)];
    let packed = packed(probe, Compression::fast())?;
    Ok(
        match packed.len() as f64 > WORTHWHILE * probe.len() as f64 {
            true => Compression::none(),
            false => Compression::fast(),
        },
    )
}

/// A block that ends at a whole byte, and its checksum.
fn deflated(block: &[u8]) -> Result<(Vec<u8>, Crc)> {
    let mut crc = Crc::new();
    crc.update(block);
    Ok((packed(block, level(block)?)?, crc))
}

/// A block of deflate that ends at a whole byte and is not the last.
fn packed(block: &[u8], level: Compression) -> Result<Vec<u8>> {
    let mut state = Compress::new(level, false);
    let mut out = Vec::with_capacity(block.len() + block.len() / 8 + 1024);
    loop {
        let rest = &block[state.total_in() as usize..];
        let status = state.compress_vec(rest, &mut out, FlushCompress::Sync)?;
        // Room that is left says that all was flushed.
        if state.total_in() as usize == block.len() && out.len() < out.capacity() {
            return Ok(out);
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
            assert!(packed.len() < back.len() + back.len() / 1000 + 64);
        }
    }

    #[test]
    fn what_shrinks_is_compressed_and_noise_is_stored() {
        let noise: Vec<u8> = (0..BLOCK as u32)
            .map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8 ^ (i.wrapping_mul(i) >> 7) as u8)
            .collect();
        let packed = |block: &[u8]| deflated(block).unwrap().0.len();
        assert!(packed(&vec![7; BLOCK]) < BLOCK / 50);
        assert!((BLOCK..BLOCK + 1000).contains(&packed(&noise)));
    }
}
