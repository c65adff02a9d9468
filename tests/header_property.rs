//! Any combination of spacing, orientation, units, byte order, skips, type and scale, written by an independent writer, is
//! read as the same physical volume: each value at its place in the world.
//!
//! Default: 60 headers a format. A long run of `BONEPD_HEADER_CASES` (default 10 000) a format:
//!
//!     cargo test --release --test all -- --ignored --nocapture header_property

use crate::written::dicom::{self, Element, Value, decimals, items, text};
use crate::written::nifti::{self, code};
use crate::written::text::Header;
use crate::written::{Files, bzip2, gzip, scalars, with, zlib};
use bonepd_ct::image::scan;
use proptest::prelude::*;
use proptest::sample::select;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

/// Voxels at `origin + Σ index · spacing · axis`, in mm, RAS.
#[derive(Debug, Clone)]
struct Place {
    n: [usize; 3],
    spacing: [f64; 3],
    /// Unit vectors of the stored axes.
    axes: [[f64; 3]; 3],
    origin: [f64; 3],
}

impl Place {
    fn world(&self, index: usize) -> [f64; 3] {
        let [nx, ny, _] = self.n;
        let at = [index % nx, index / nx % ny, index / (nx * ny)];
        std::array::from_fn(|r| {
            let along = |a: usize| at[a] as f64 * self.spacing[a] * self.axes[a][r];
            self.origin[r] + (0..3).map(along).sum::<f64>()
        })
    }

    fn voxels(&self) -> usize {
        self.n.iter().product()
    }

    /// The same place for programs that count to the left and back.
    fn lps(&self) -> Place {
        let turn = |[x, y, z]: [f64; 3]| [0.0 - x, 0.0 - y, z];
        Place {
            axes: self.axes.map(turn),
            origin: turn(self.origin),
            ..self.clone()
        }
    }
}

fn places() -> impl Strategy<Value = Place> {
    let sizes = prop::array::uniform3(1..=5usize);
    let spacing = prop::array::uniform3(40..2000i32);
    let origin = prop::array::uniform3(-40_000..40_000i32);
    let permutation = select(
        &[
            [0, 1, 2],
            [0, 2, 1],
            [1, 0, 2],
            [1, 2, 0],
            [2, 0, 1],
            [2, 1, 0],
        ][..],
    );
    let tilt = prop_oneof![Just(0.0f64), -0.3..0.3f64];
    (
        sizes,
        spacing,
        origin,
        permutation,
        any::<[bool; 3]>(),
        tilt,
    )
        .prop_map(|(n, spacing, origin, to, back, tilt)| {
            let (s, c) = tilt.sin_cos();
            // A turn about the axis (2, 1, 2) / 3.
            let u = [2.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0];
            let turned = |v: [f64; 3]| -> [f64; 3] {
                let dot: f64 = (0..3).map(|r| u[r] * v[r]).sum();
                std::array::from_fn(|r| {
                    let (p, q) = ((r + 1) % 3, (r + 2) % 3);
                    c * v[r] + s * (u[p] * v[q] - u[q] * v[p]) + (1.0 - c) * dot * u[r]
                })
            };
            Place {
                n,
                spacing: spacing.map(|v| f64::from(v) * 1e-4),
                axes: std::array::from_fn(|a| {
                    let mut axis = [0.0; 3];
                    axis[to[a]] = if back[a] { -1.0 } else { 1.0 };
                    turned(axis)
                }),
                origin: origin.map(|v| f64::from(v) * 1e-3),
            }
        })
}

const KINDS: [&str; 10] = [
    "uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float32", "float64",
];

/// Different for each voxel, and a number of every type.
fn stored_value(kind: &str, index: usize) -> f64 {
    index as f64 - if kind.starts_with("uint") { 0.0 } else { 40.0 }
}

fn stored_values(kind: &str, place: &Place) -> Vec<f64> {
    (0..place.voxels()).map(|i| stored_value(kind, i)).collect()
}

/// Reads `files` and holds each value to its place. `scale` is slope and intercept of the values.
fn hold(files: &Files, place: &Place, kind: &str, scale: [f64; 2]) -> Result<(), TestCaseError> {
    hold_within(files, place, kind, scale, 2e-5)
}

/// The same with another error of places in mm.
fn hold_within(
    files: &Files,
    place: &Place,
    kind: &str,
    scale: [f64; 2],
    tolerance_mm: f64,
) -> Result<(), TestCaseError> {
    let scan = with(files, |path| scan::read(path, None))
        .map_err(|e| TestCaseError::fail(format!("refused: {e}")))?;
    let (volume, n) = (&scan.volume, scan.volume.grid.n);
    prop_assert_eq!(volume.as_slice().len(), place.voxels());
    let rows = volume.affine.expect("an orientation");
    let mut seen = vec![false; place.voxels()];
    for (at, &value) in volume.as_slice().iter().enumerate() {
        let p = [at % n[0], at / n[0] % n[1], at / (n[0] * n[1])];
        let stored = (f64::from(value) - scale[1]) / scale[0];
        let index = (stored - stored_value(kind, 0)).round() as usize;
        prop_assert!(index < seen.len() && !seen[index], "value {value} at {p:?}");
        seen[index] = true;
        let expected = place.world(index);
        for r in 0..3 {
            let found = rows[r][3] + (0..3).map(|c| rows[r][c] * p[c] as f64).sum::<f64>();
            let error = (found - expected[r]).abs();
            prop_assert!(
                error < tolerance_mm,
                "voxel {index} at {found}, not {}",
                expected[r]
            );
        }
    }
    for (a, edge) in volume.grid.spacing_mm.into_iter().enumerate() {
        let norm = (0..3).map(|r| rows[r][a].powi(2)).sum::<f64>().sqrt();
        prop_assert!((norm / edge - 1.0).abs() < 1e-4, "{norm} {edge}");
        prop_assert!(rows[a][a] > 0.0, "axis {a} runs backwards");
    }
    Ok(())
}

fn cases(long: bool) -> u32 {
    let set = std::env::var("BONEPD_HEADER_CASES").ok();
    match long {
        true => set.and_then(|v| v.parse().ok()).unwrap_or(10_000),
        false => 60,
    }
}

fn run<T: std::fmt::Debug>(
    name: &str,
    long: bool,
    strategy: impl Strategy<Value = T>,
    test: impl Fn(T) -> Result<(), TestCaseError>,
) {
    let config = Config {
        cases: cases(long),
        failure_persistence: None,
        ..Config::default()
    };
    let random = TestRng::from_seed(RngAlgorithm::ChaCha, &[7; 32]);
    let start = std::time::Instant::now();
    if let Err(e) = TestRunner::new_with_rng(config, random).run(&strategy, test) {
        panic!("{name}: {e}");
    }
    println!("{name}: {} headers, {:.1?}", cases(long), start.elapsed());
}

/// Of a right-handed rotation's columns: scalar part aside (`nifti1.h`).
fn quaternion(axes: [[f64; 3]; 3]) -> [f64; 3] {
    let r = |row: usize, column: usize| axes[column][row];
    let trace = r(0, 0) + r(1, 1) + r(2, 2);
    if trace > -0.9 {
        let a = 0.5 * (1.0 + trace).sqrt();
        return [
            (r(2, 1) - r(1, 2)) / (4.0 * a),
            (r(0, 2) - r(2, 0)) / (4.0 * a),
            (r(1, 0) - r(0, 1)) / (4.0 * a),
        ];
    }
    // Half a turn: the axis by its largest part, its sign by the scalar part.
    let square: [f64; 3] = std::array::from_fn(|i| (0.25 * (1.0 + 2.0 * r(i, i) - trace)).max(0.0));
    let i = (0..3)
        .max_by(|a, b| square[*a].total_cmp(&square[*b]))
        .unwrap();
    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
    let mut q = [0.0; 3];
    q[i] = square[i].sqrt();
    q[j] = (r(j, i) + r(i, j)) / (4.0 * q[i]);
    q[k] = (r(k, i) + r(i, k)) / (4.0 * q[i]);
    let a = (r(k, j) - r(j, k)) / (4.0 * q[i]);
    if a < 0.0 { q.map(|v| -v) } else { q }
}

fn determinant(a: [[f64; 3]; 3]) -> f64 {
    let minor = |i: usize, j: usize| a[1][i] * a[2][j] - a[1][j] * a[2][i];
    a[0][0] * minor(1, 2) - a[0][1] * minor(0, 2) + a[0][2] * minor(0, 1)
}

fn nifti_headers(long: bool) {
    let how = (
        select(&KINDS[..]),
        any::<[bool; 5]>(),
        select(&[(1.0, 1e3), (2.0, 1.0), (3.0, 1e-3)][..]),
        0..4usize,
        select(&[[1.0, 0.0], [2.0, 100.0], [-0.5, 3.0]][..]),
    );
    run("NIfTI", long, (places(), how), |(place, how)| {
        let (kind, [big, two, pair, compressed, sform], (unit, mm), more, scale) = how;
        let mut h = nifti::Header::new(1 + u8::from(two), big);
        let [nx, ny, nz] = place.n.map(|n| n as f64);
        h.set("dim", &[3.0, nx, ny, nz, 1.0, 1.0, 1.0, 1.0]);
        let [datatype, bits] = code(kind);
        h.set("datatype", &[datatype]);
        h.set("bitpix", &[bits]);
        h.set("xyzt_units", &[unit]);
        h.set("scl_slope", &scale[..1]);
        h.set("scl_inter", &scale[1..]);
        let hand = determinant(place.axes).signum();
        let [x, y, z] = place.spacing.map(|s| s / mm);
        h.set("pixdim", &[hand, x, y, z]);
        if sform {
            for (r, name) in ["srow_x", "srow_y", "srow_z"].into_iter().enumerate() {
                let column = |a: usize| place.axes[a][r] * place.spacing[a] / mm;
                h.set(
                    name,
                    &[column(0), column(1), column(2), place.origin[r] / mm],
                );
            }
            h.set("sform_code", &[2.0]);
        } else {
            let [a, b, c] = place.axes;
            let q = quaternion([a, b, c.map(|v| hand * v)]);
            for (i, name) in ["quatern_b", "quatern_c", "quatern_d"]
                .into_iter()
                .enumerate()
            {
                h.set(name, &q[i..=i]);
            }
            for (i, name) in ["qoffset_x", "qoffset_y", "qoffset_z"]
                .into_iter()
                .enumerate()
            {
                h.set(name, &[place.origin[i] / mm]);
            }
            h.set("qform_code", &[1.0]);
        }
        let voxels = scalars(kind, big, &stored_values(kind, &place));
        let packed = |bytes: Vec<u8>| if compressed { gzip(&bytes) } else { bytes };
        let gz = if compressed { ".gz" } else { "" };
        let files = if pair {
            h.pair();
            h.set("vox_offset", &[16.0 * more as f64]);
            let image = [vec![9; 16 * more], voxels].concat();
            vec![
                (format!("s.1.hdr{gz}"), packed(h.bytes)),
                (format!("s.1.img{gz}"), packed(image)),
                ("s.img".into(), vec![1; 4000]),
            ]
        } else {
            let offset = if two { 544 } else { 352 } + 16 * more;
            h.set("vox_offset", &[offset as f64]);
            let gap = vec![0; offset - h.bytes.len()];
            vec![(
                format!("s.1.nii{gz}"),
                packed([h.bytes, gap, voxels].concat()),
            )]
        };
        // Three of a quaternion's numbers are stored; with 24 bits the fourth is good to the root of their last bit.
        let reach: f64 = (0..3).map(|a| place.n[a] as f64 * place.spacing[a]).sum();
        let single = if sform || two { 0.0 } else { 5e-4 * reach };
        hold_within(&files, &place, kind, scale, 2e-5 + single)
    });
}

/// Voxels of a header in one file, or cut into slices.
fn pieces(voxels: &[u8], slices: usize, split: bool) -> Vec<Vec<u8>> {
    match split {
        true => voxels
            .chunks(voxels.len() / slices)
            .map(<[u8]>::to_vec)
            .collect(),
        false => vec![voxels.to_vec()],
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Where {
    After,
    Beside,
    List,
    Pattern,
}

const WHERE: [Where; 4] = [Where::After, Where::Beside, Where::List, Where::Pattern];

fn nrrd_headers(long: bool) {
    let how = (
        select(&KINDS[..]),
        any::<[bool; 4]>(),
        select(&WHERE[..]),
        select(&["raw", "gzip", "bzip2", "hex", "text", "RAW", "GZ"][..]),
        select(
            &[
                ("um", 1e-3),
                ("\u{b5}m", 1e-3),
                ("mm", 1.0),
                ("cm", 10.0),
                ("", 1.0),
            ][..],
        ),
        0..3usize,
        -1..9i64,
    );
    run("NRRD", long, (places(), how), |(place, how)| {
        let (kind, [big, spelled, lps, axis], at, encoding, (unit, mm), lines, bytes) = how;
        let world = if lps { place.lps() } else { place.clone() };
        let vector = |v: [f64; 3]| format!("({:?},{:?},{:?})", v[0] / mm, v[1] / mm, v[2] / mm);
        let column = |a: usize| vector(world.axes[a].map(|v| v * world.spacing[a]));
        let [nx, ny, nz] = place.n;
        let (before, none, four) = if axis {
            ("1 ", "none ", "4")
        } else {
            ("", "", "3")
        };
        let mut h = Header::new(&[
            ("content", "made"),
            (
                "type",
                match (spelled, kind) {
                    (true, "uint8") => "Unsigned Char",
                    (true, "int16") => "SHORT",
                    (_, "float32") => "float",
                    (_, "float64") => "double",
                    (_, other) => other,
                },
            ),
            ("dimension", four),
            (
                if lps { "space" } else { "Space" },
                if lps {
                    "LPS"
                } else {
                    "right-anterior-superior"
                },
            ),
        ]);
        let last = |h: &mut Header, key: &str, value: String| h.0.push((key.into(), value));
        last(&mut h, "sizes", format!("{before}{nx} {ny} {nz}"));
        let directions = format!("{none}{} {} {}", column(0), column(1), column(2));
        last(&mut h, "space directions", directions);
        last(&mut h, "space origin", vector(world.origin));
        if !unit.is_empty() {
            last(
                &mut h,
                "space units",
                format!("\"{unit}\" \"{unit}\" \"{unit}\""),
            );
        }
        last(&mut h, "encoding", encoding.into());
        last(&mut h, "endian", if big { "BIG" } else { "little" }.into());
        let coded = |part: &[u8], numbers: &[f64]| match encoding.to_lowercase().as_str() {
            "gzip" | "gz" => gzip(part),
            "bzip2" => bzip2(part),
            "hex" => part
                .iter()
                .map(|b| format!("{b:02x}\n"))
                .collect::<String>()
                .into_bytes(),
            "text" => numbers
                .iter()
                .map(|v| format!("{v} "))
                .collect::<String>()
                .into_bytes(),
            _ => part.to_vec(),
        };
        let binary = !["hex", "text"].contains(&encoding);
        let skip = if binary { bytes } else { 0 };
        last(
            &mut h,
            if spelled { "byteskip" } else { "byte skip" },
            skip.to_string(),
        );
        last(
            &mut h,
            if spelled { "lineskip" } else { "line skip" },
            lines.to_string(),
        );
        let numbers = stored_values(kind, &place);
        let voxels = scalars(kind, big, &numbers);
        let split = matches!(at, Where::List | Where::Pattern);
        let of = if split { nx * ny } else { nx * ny * nz };
        let files = pieces(&voxels, nz, split)
            .into_iter()
            .zip(numbers.chunks(of))
            .map(|(part, numbers)| {
                let skipped = if skip < 0 { 5 } else { skip as usize };
                let padded = match binary {
                    true => [vec![3; skipped], part].concat(),
                    false => part,
                };
                [b"a line\n".repeat(lines), coded(&padded, numbers)].concat()
            });
        let mut files: Files = files
            .enumerate()
            .map(|(k, f)| (format!("v 0{k}.bin"), f))
            .collect();
        match at {
            Where::After => {}
            Where::Beside => last(&mut h, "data file", "v 00.bin".into()),
            Where::Pattern => last(&mut h, "data file", format!("v %02d.bin 0 {} 1 2", nz - 1)),
            Where::List => {
                let names: Vec<&str> = files.iter().map(|f| f.0.as_str()).collect();
                last(&mut h, "datafile", format!("LIST\n{}", names.join("\n")));
            }
        }
        let header = match at {
            Where::After => [h.nrrd(), files.remove(0).1].concat(),
            _ => h.nrrd(),
        };
        files.insert(0, ("s.nhdr".into(), header));
        hold(&files, &place, kind, [1.0, 0.0])
    });
}

fn metaimage_headers(long: bool) {
    let how = (
        select(&KINDS[..]),
        any::<[bool; 4]>(),
        select(&WHERE[..]),
        0..3usize,
        select(&[("um", 1e-3), ("mm", 1.0), ("", 1.0)][..]),
        select(&[[1.0, 0.0], [2.0, 100.0]][..]),
        -1..9i64,
    );
    run("MetaImage", long, (places(), how), |(place, how)| {
        let (kind, [big, four, spelled, size], at, coding, (unit, mm), scale, bytes) = how;
        let world = place.lps();
        let mut matrix: Vec<f64> = world.axes.concat();
        let [x, y, z] = world.spacing.map(|s| s / mm);
        let (mut sizes, mut spacing) = (place.n.to_vec(), vec![x, y, z]);
        let mut origin = world.origin.to_vec();
        if four {
            let axis = |a: usize| [world.axes[a].to_vec(), vec![0.0]].concat();
            matrix = [axis(0), axis(1), axis(2), vec![0.0, 0.0, 0.0, 1.0]].concat();
            (sizes, spacing) = ([sizes, vec![1]].concat(), [spacing, vec![1.0]].concat());
            origin.push(0.0);
        }
        let words = |v: &[f64]| {
            v.iter()
                .map(|v| format!("{v:?}"))
                .collect::<Vec<_>>()
                .join(" ")
        };
        let element = match kind {
            "uint8" => "MET_UCHAR",
            "int8" => "MET_CHAR",
            "uint16" => "MET_USHORT",
            "int16" => "MET_SHORT",
            "uint32" => "MET_UINT",
            "int32" => "MET_LONG",
            "uint64" => "MET_ULONG_LONG",
            "int64" => "MET_LONG_LONG",
            "float32" => "MET_FLOAT",
            _ => "MET_DOUBLE",
        };
        // Binary, compressed, text.
        let (compressed, text) = (coding == 1, coding == 2);
        let skip = if text || (compressed && bytes < 0) || at == Where::After {
            0
        } else {
            bytes
        };
        let mut h = Header::new(&[
            ("ObjectType", "Image"),
            ("NDims", if four { "4" } else { "3" }),
        ]);
        let mut last = |key: &str, value: String| h.0.push((key.into(), value));
        last(
            "DimSize",
            sizes
                .iter()
                .map(usize::to_string)
                .collect::<Vec<_>>()
                .join(" "),
        );
        last(
            if size {
                "ElementSize"
            } else {
                "ElementSpacing"
            },
            words(&spacing),
        );
        last(
            if spelled {
                "Orientation"
            } else {
                "TransformMatrix"
            },
            words(&matrix),
        );
        last(if spelled { "Position" } else { "Offset" }, words(&origin));
        last("ElementType", element.into());
        last(
            "ElementByteOrderMSB",
            if big { "True" } else { "False" }.into(),
        );
        last("BinaryData", if text { "False" } else { "True" }.into());
        last(
            "CompressedData",
            if compressed { "True" } else { "False" }.into(),
        );
        last("HeaderSize", skip.to_string());
        if !unit.is_empty() {
            last("DistanceUnits", unit.into());
        }
        if scale != [1.0, 0.0] {
            last("ElementToIntensityFunctionSlope", scale[0].to_string());
            last("ElementToIntensityFunctionOffset", scale[1].to_string());
        }
        let numbers = stored_values(kind, &place);
        let voxels = scalars(kind, big, &numbers);
        let [nx, ny, nz] = place.n;
        let split = matches!(at, Where::List | Where::Pattern);
        let of = if split { nx * ny } else { nx * ny * nz };
        let parts = pieces(&voxels, nz, split)
            .into_iter()
            .zip(numbers.chunks(of));
        let mut files: Files = parts
            .enumerate()
            .map(|(k, (part, numbers))| {
                let body = match coding {
                    1 => zlib(&part),
                    2 => words(numbers).into_bytes(),
                    _ => part,
                };
                let skipped = if skip < 0 { 5 } else { skip as usize };
                (format!("v0{k}.raw"), [vec![3; skipped], body].concat())
            })
            .collect();
        let names: Vec<String> = files.iter().map(|f| f.0.clone()).collect();
        last(
            "ElementDataFile",
            match at {
                Where::After => "LOCAL".into(),
                Where::Beside => names[0].clone(),
                Where::Pattern => format!("v%02d.raw 0 {} 1", nz - 1),
                Where::List => format!(
                    "LIST{}\n{}",
                    if spelled { " 2D" } else { "" },
                    names.join("\n")
                ),
            },
        );
        let header = match at {
            Where::After => [h.metaimage(), files.remove(0).1].concat(),
            _ => h.metaimage(),
        };
        files.insert(0, ("s.mhd".into(), header));
        hold(&files, &place, kind, scale)
    });
}

fn syntaxes() -> impl Strategy<Value = dicom::Syntax> {
    (0..6usize, any::<[bool; 3]>()).prop_map(|(which, [open, unknown, padded])| {
        let mut s = dicom::Syntax {
            open,
            unknown,
            padded,
            ..dicom::EXPLICIT
        };
        match which {
            0 => s.implicit = true,
            1 => (s.big_endian, s.unknown) = (true, false),
            2 => s.deflated = true,
            3 => s.rle = true,
            4 => s.preamble = false,
            _ => (s.preamble, s.meta) = (false, false),
        }
        s
    })
}

fn dicom_headers(long: bool) {
    let how = (
        syntaxes(),
        any::<[bool; 2]>(),
        0..6u16,
        select(&[[1.0, 0.0], [2.0, -1000.0], [0.5, 7.0]][..]),
        0..1000usize,
    );
    run("DICOM", long, (places(), how), |(place, how)| {
        let (syntax, [enhanced, signed], unused, scale, shuffle) = how;
        let world = place.lps();
        let [nx, ny, nz] = place.n;
        let kind = if signed { "int16" } else { "uint16" };
        let stored = 16 - unused;
        // Bits above the stored ones hold an overlay.
        let word = |index: usize| {
            let value = stored_value(kind, index) as i32;
            let mask = ((1u32 << stored) - 1) as u16;
            (value as u16 & mask) | (0xA5A5 & !mask)
        };
        let words: Vec<u16> = (0..place.voxels()).map(word).collect();
        let directions = decimals([0, 1, 2, 3, 4, 5].map(|i| world.axes[i / 3][i % 3]));
        let position = |k: usize| {
            let along = k as f64 * world.spacing[2];
            decimals([0, 1, 2].map(|r| world.origin[r] + along * world.axes[2][r]))
        };
        let pixel = decimals([world.spacing[1], world.spacing[0]]);
        let common = || -> Vec<Element> {
            let mut e = dicom::slice([nx as u16, ny as u16], [0.0; 3], 1);
            e.retain(|e| !matches!(e.tag, [0x20, 0x32] | [0x20, 0x37] | [0x28, 0x30]));
            dicom::set(&mut e, dicom::short([0x28, 0x101], stored));
            dicom::set(&mut e, dicom::short([0x28, 0x102], stored - 1));
            dicom::set(&mut e, dicom::short([0x28, 0x103], u16::from(signed)));
            e.push(items(
                [0x40, 0x275],
                vec![vec![text([0x40, 7], "LO", "request")]],
            ));
            e.push(text([0x18, 0x50], "DS", world.spacing[2]));
            e
        };
        let rescale = || {
            vec![
                text([0x28, 0x1052], "DS", scale[1]),
                text([0x28, 0x1053], "DS", scale[0]),
                text([0x28, 0x1054], "LO", "HU"),
            ]
        };
        let pixels = |frames: Vec<&[u16]>| match syntax.rle {
            false => dicom::pixels(&frames.concat()),
            true => {
                let parts = frames.iter().map(|f| dicom::rle(f));
                Element {
                    tag: [0x7FE0, 0x10],
                    vr: "OB",
                    value: Value::Fragments([Vec::new()].into_iter().chain(parts).collect()),
                }
            }
        };
        let slices: Vec<&[u16]> = words.chunks(nx * ny).collect();
        // Frames and files in another order than along the normal.
        let mut order: Vec<usize> = (0..nz).collect();
        (0..nz).for_each(|k| order.swap(k, (shuffle + 3 * k) % nz));
        let files: Files = if enhanced {
            let mut e = common();
            e.push(text([0x28, 8], "IS", nz));
            let one = |tag, inner: Vec<Element>| items(tag, vec![inner]);
            let shared = vec![
                one(
                    [0x28, 0x9110],
                    vec![
                        text([0x28, 0x30], "DS", &pixel),
                        text([0x18, 0x50], "DS", world.spacing[2]),
                    ],
                ),
                one([0x20, 0x9116], vec![text([0x20, 0x37], "DS", &directions)]),
                one([0x28, 0x9145], rescale()),
            ];
            e.push(items([0x5200, 0x9229], vec![shared]));
            let of = |k: &usize| {
                vec![one(
                    [0x20, 0x9113],
                    vec![text([0x20, 0x32], "DS", position(*k))],
                )]
            };
            e.push(items([0x5200, 0x9230], order.iter().map(of).collect()));
            e.push(pixels(order.iter().map(|k| slices[*k]).collect()));
            vec![("IM0".into(), syntax.file(&e))]
        } else {
            let file = |(name, k): (usize, &usize)| {
                let mut e = common();
                e.push(text([0x20, 0x32], "DS", position(*k)));
                e.push(text([0x20, 0x37], "DS", &directions));
                e.push(text([0x28, 0x30], "DS", &pixel));
                e.extend(rescale());
                e.push(pixels(vec![slices[*k]]));
                (format!("s/IM{name}"), syntax.file(&e))
            };
            order.iter().enumerate().map(file).collect()
        };
        hold(&files, &place, kind, scale)
    });
}

#[test]
fn nifti_is_read_where_it_lies() {
    nifti_headers(false);
}

#[test]
fn nrrd_is_read_where_it_lies() {
    nrrd_headers(false);
}

#[test]
fn metaimage_is_read_where_it_lies() {
    metaimage_headers(false);
}

#[test]
fn dicom_is_read_where_it_lies() {
    dicom_headers(false);
}

#[test]
#[ignore = "10 000 headers a format"]
fn all_formats_are_read_where_they_lie() {
    nifti_headers(true);
    nrrd_headers(true);
    metaimage_headers(true);
    dicom_headers(true);
}
