//! Headers of any combination: the same physical volume whatever the spacing, unit, byte order, type and storage.
//!
//! A few hundred of each format by default; `BONEPD_HEADER_CASES` of each in the long run (10 000):
//!
//!     cargo test --release --test all -- --ignored --nocapture headers::ten_thousand

use super::file;
use super::write::{Order, Packing, Page, Value, tiff};
use bonepd_ct::image::scan;
use bonepd_ct::image::stored::Stored;
use proptest::prelude::*;
use proptest::sample::select;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

/// How the numbers of a volume are stored: bits and kind, and the bit pattern and value of each.
#[derive(Debug, Clone)]
struct Numbers {
    bits: usize,
    format: u16,
    patterns: Vec<u64>,
    values: Vec<f32>,
}

fn numbers(n: usize, kinds: &'static [(usize, u16)]) -> impl Strategy<Value = Numbers> {
    (select(kinds), prop::collection::vec(any::<u64>(), n)).prop_map(|((bits, format), raw)| {
        let low = |v: u64| v & (u64::MAX >> (64 - bits));
        let (patterns, values) = raw
            .into_iter()
            .map(|v| match (format, bits) {
                (3, 32) => {
                    let value = f64::from(v as i32) as f32 / 1024.0;
                    (u64::from(value.to_bits()), value)
                }
                (3, _) => {
                    let value = v as i64 as f64 / 1e9;
                    (value.to_bits(), value as f32)
                }
                (2, _) => (
                    low(v),
                    ((low(v) << (64 - bits)) as i64 >> (64 - bits)) as f32,
                ),
                _ => (low(v), low(v) as f32),
            })
            .unzip();
        Numbers {
            bits,
            format,
            patterns,
            values,
        }
    })
}

/// A unit of length as programs spell it, and its millimetres.
const UNITS: [(&str, f64); 10] = [
    ("mm", 1.0),
    ("um", 1e-3),
    ("µm", 1e-3),
    ("\\u00B5m", 1e-3),
    ("micron", 1e-3),
    ("micrometers", 1e-3),
    ("nm", 1e-6),
    ("cm", 10.0),
    ("inch", 25.4),
    ("m", 1000.0),
];

/// What a file is to be read as.
#[derive(Debug)]
struct Expected {
    n: [usize; 3],
    values: Vec<f32>,
    spacing_mm: Option<[f64; 3]>,
}

fn holds(found: Result<Stored, String>, expected: &Expected) -> Result<(), TestCaseError> {
    let found = found.map_err(TestCaseError::fail)?;
    prop_assert_eq!(found.n, expected.n);
    prop_assert_eq!(&found.values, &expected.values);
    let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-6;
    let same = match (found.spacing_mm, expected.spacing_mm) {
        (Some(a), Some(b)) => (0..3).all(|i| near(a[i], b[i])),
        (a, b) => a == b,
    };
    prop_assert!(
        same,
        "voxel size {:?}, expected {:?}",
        found.spacing_mm,
        expected.spacing_mm
    );
    Ok(())
}

fn read(name: &str, bytes: &[u8]) -> Result<Stored, String> {
    let (_dir, path) = file(name, bytes);
    scan::stored(&path).map_err(|e| e.to_string())
}

const TIFF_KINDS: &[(usize, u16)] = &[
    (1, 1),
    (4, 1),
    (8, 1),
    (8, 2),
    (12, 1),
    (16, 1),
    (16, 2),
    (24, 1),
    (32, 1),
    (32, 2),
    (32, 3),
    (64, 1),
    (64, 2),
    (64, 3),
];
const NPY_KINDS: &[(usize, u16)] = &[
    (8, 1),
    (8, 2),
    (16, 1),
    (16, 2),
    (32, 1),
    (32, 2),
    (32, 3),
    (64, 1),
    (64, 2),
    (64, 3),
];

const PACKINGS: [Packing; 5] = [
    Packing::None,
    Packing::Deflate,
    Packing::Lzw,
    Packing::PackBits,
    Packing::Zstandard,
];

/// Pages of a random storage.
fn stored_pages() -> impl Strategy<Value = ([usize; 3], Numbers, Vec<Page>, Order)> {
    (
        [1..9usize, 1..9usize, 1..5usize],
        any::<[bool; 4]>(),
        select(&PACKINGS[..]),
        1..9usize,
        1..4u16,
    )
        .prop_flat_map(|(n, flags, packing, rows, predictor)| {
            numbers(n.iter().product(), TIFF_KINDS).prop_map(move |numbers| {
                let [big_endian, big_tiff, tiled, reversed_bits] = flags;
                let predictor = match (predictor, numbers.format, numbers.bits) {
                    (3, 3, 32 | 64) => 3,
                    (2, _, 8 | 16 | 32 | 64) => 2,
                    _ => 1,
                };
                let planes = numbers.patterns.chunks(n[0] * n[1]).map(|plane| Page {
                    bits: numbers.bits,
                    format: numbers.format,
                    packing,
                    predictor,
                    reversed_bits,
                    rows_per_strip: rows.min(n[1]),
                    tile: tiled.then_some([16, 16]),
                    photometric: u16::from(rows % 2 == 0),
                    ..Page::grey(n[0], n[1], plane.to_vec())
                });
                let pages = planes.collect();
                (
                    n,
                    numbers,
                    pages,
                    Order {
                        big_endian,
                        big_tiff,
                    },
                )
            })
        })
}

fn edge() -> impl Strategy<Value = u32> {
    1..5000u32
}

/// Pages of a second go into a file with this description and these pixels (over 100) per unit.
fn described(
    mut pages: Vec<Page>,
    text: &str,
    per_unit: Option<[(u32, u32); 2]>,
    order: Order,
) -> Vec<u8> {
    let mut first = pages[0]
        .clone()
        .with(270, Value::Ascii(text.as_bytes().to_vec()));
    if let Some([(a, b), (c, d)]) = per_unit {
        first = first
            .with(282, Value::Rational(a, b))
            .with(283, Value::Rational(c, d))
            .with(296, Value::Short(vec![1]));
    }
    pages[0] = first;
    tiff(&pages, order)
}

fn try_cases<S: Strategy>(
    cases: u32,
    seed: u64,
    strategy: S,
    test: impl Fn(S::Value) -> Result<(), TestCaseError>,
) {
    let config = Config {
        cases,
        failure_persistence: None,
        ..Config::default()
    };
    let mut seeds = [7u8; 32];
    seeds[..8].copy_from_slice(&seed.to_le_bytes());
    let mut runner =
        TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &seeds));
    runner
        .run(&strategy, test)
        .unwrap_or_else(|e| panic!("{e}"));
}

fn plain_tiff(cases: u32, seed: u64) {
    try_cases(
        cases,
        seed,
        (stored_pages(), edge(), edge()),
        |((n, numbers, pages, order), x, y)| {
            // Pixels per centimetre of sizes in units of 0.1 µm that no printer has.
            let pages: Vec<Page> = pages
                .into_iter()
                .map(|page| {
                    page.with(282, Value::Rational(100_000, x))
                        .with(283, Value::Rational(100_000, y))
                        .with(296, Value::Short(vec![3]))
                })
                .collect();
            let found = read("a.tif", &tiff(&pages, order));
            let size = [x, y].map(|h| f64::from(h) * 1e-4);
            // Whether a resolution is a printer's has tests of its own.
            let known = found.as_ref().is_ok_and(|s| s.spacing_mm.is_some());
            let spacing_mm = known.then_some([size[0], size[1], size[1]]);
            holds(
                found,
                &Expected {
                    n,
                    values: numbers.values,
                    spacing_mm,
                },
            )
        },
    );
}

fn imagej(cases: u32, seed: u64) {
    let units = (
        select(&UNITS[..]),
        prop::option::of(select(&UNITS[..])),
        prop::option::of(select(&UNITS[..])),
    );
    let depth = prop::option::of((any::<bool>(), edge()));
    try_cases(
        cases,
        seed,
        (stored_pages(), edge(), edge(), units, depth, any::<bool>()),
        |(stored, x, y, units, depth, as_times)| {
            let (n, numbers, pages, order) = stored;
            let (unit, yunit, zunit) = units;
            let nz = n[2];
            let axis = if as_times { "frames" } else { "slices" };
            let mut text = format!("ImageJ=1.54f\nimages={nz}\n{axis}={nz}\nunit={}\n", unit.0);
            yunit
                .iter()
                .for_each(|u| text += &format!("yunit={}\n", u.0));
            zunit
                .iter()
                .for_each(|u| text += &format!("zunit={}\n", u.0));
            if let Some((negative, z)) = depth {
                text += &format!("spacing={}{z}\n", if negative { "-" } else { "" });
            }
            let y_mm = yunit.unwrap_or(unit).1 * f64::from(y);
            let z_mm = zunit.unwrap_or(unit).1 * depth.map_or(1.0, |(_, z)| f64::from(z));
            let spacing = [
                unit.1 * f64::from(x),
                y_mm,
                if nz > 1 { z_mm } else { y_mm },
            ];
            let bytes = described(pages, &text, Some([(1, x), (1, y)]), order);
            let expected = Expected {
                n,
                values: numbers.values,
                spacing_mm: Some(spacing),
            };
            holds(read("a.tif", &bytes), &expected)
        },
    );
}

fn ome(cases: u32, seed: u64) {
    let unit = || {
        prop::option::of(select(
            &[
                ("µm", 1e-3),
                ("&#181;m", 1e-3),
                ("nm", 1e-6),
                ("mm", 1.0),
                ("cm", 10.0),
            ][..],
        ))
    };
    let shuffled = any::<prop::sample::Index>();
    try_cases(
        cases,
        seed,
        (
            stored_pages(),
            [edge(), edge(), edge()],
            [unit(), unit(), unit()],
            any::<[bool; 2]>(),
            shuffled,
        ),
        |(stored, edges, units, flags, turn)| {
            let (n, numbers, pages, order) = stored;
            let [single, as_times] = flags;
            let quote = if single { '\'' } else { '"' };
            let [nx, ny, nz] = n;
            let (z, t) = if as_times { (1, nz) } else { (nz, 1) };
            let mut text = format!(
                "<?xml version=\"1.0\" encoding=\"UTF-8\"?><OME xmlns=\"http://x\"><Image ID=\"Image:0\"><Pixels SizeX=\"{nx}\" SizeY=\"{ny}\"\n SizeZ='{z}' SizeC=\"1\" SizeT=\"{t}\""
            );
            let mut spacing = [0.0; 3];
            for a in 0..3 {
                let name = ["X", "Y", "Z"][a];
                text += &format!("\tPhysicalSize{name}={quote}{}{quote}", edges[a]);
                if let Some((unit, _)) = units[a] {
                    text += &format!(" PhysicalSize{name}Unit = {quote}{unit}{quote}");
                }
                spacing[a] = f64::from(edges[a]) * units[a].map_or(1e-3, |u| u.1);
            }
            text += ">";
            // Page k of the file is slice k + shift of the scan.
            let shift = turn.index(nz);
            for k in 0..nz {
                let first = if as_times { "FirstT" } else { "FirstZ" };
                text += &format!(
                    "<TiffData IFD=\"{k}\" {first}=\"{}\" PlaneCount=\"1\"/>",
                    (k + shift) % nz
                );
            }
            text += "</Pixels></Image></OME>";
            let mut values = numbers.values.clone();
            values.rotate_right(shift * nx * ny);
            let bytes = described(pages, &text, None, order);
            holds(
                read("a.ome.tif", &bytes),
                &Expected {
                    n,
                    values,
                    spacing_mm: Some(spacing),
                },
            )
        },
    );
}

fn npy(cases: u32, seed: u64) {
    let sizes = [1..9usize, 1..9usize, 2..5usize];
    let stored =
        sizes.prop_flat_map(|n| numbers(n.iter().product(), NPY_KINDS).prop_map(move |v| (n, v)));
    try_cases(
        cases,
        seed,
        (stored, any::<[bool; 5]>(), 1..4u8),
        |((n, numbers), flags, version)| {
            let [big, fortran, leading, trailing, bare] = flags;
            let [nx, ny, nz] = n;
            let kind = ["u", "i", "f"][usize::from(numbers.format) - 1];
            let bytes = numbers.bits / 8;
            let mark = match (bytes, big, bare) {
                (1, ..) => "|",
                (_, true, _) => ">",
                (_, false, true) => "=",
                _ => "<",
            };
            let mut shape = vec![nz, ny, nx];
            if leading {
                shape.insert(0, 1);
            }
            if trailing {
                shape.push(1);
            }
            let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
            let order = if fortran { "True" } else { "False" };
            let mut text = format!(
                "{{'descr': '{mark}{kind}{bytes}', 'fortran_order': {order}, 'shape': ({}), }}",
                shape.join(", ")
            );
            text += &" ".repeat(63 - text.len() % 64);
            text += "\n";
            let mut out = b"\x93NUMPY".to_vec();
            out.extend([version, 0]);
            match version {
                1 => out.extend((text.len() as u16).to_le_bytes()),
                _ => out.extend((text.len() as u32).to_le_bytes()),
            }
            out.extend(text.as_bytes());
            for i in 0..numbers.patterns.len() {
                // z is fastest in Fortran's order.
                let at = match fortran {
                    true => (i % nz * ny + i / nz % ny) * nx + i / nz / ny,
                    false => i,
                };
                let word = numbers.patterns[at];
                match big && bytes > 1 {
                    true => out.extend(&word.to_be_bytes()[8 - bytes..]),
                    false => out.extend(&word.to_le_bytes()[..bytes]),
                }
            }
            holds(
                read("a.npy", &out),
                &Expected {
                    n,
                    values: numbers.values,
                    spacing_mm: None,
                },
            )
        },
    );
}

/// Writes and reads so many files of one format, from a seed.
type Property = fn(u32, u64);

const FORMATS: [(&str, Property); 4] = [
    ("TIFF", plain_tiff),
    ("ImageJ", imagej),
    ("OME-TIFF", ome),
    ("npy", npy),
];

#[test]
fn any_header_is_read_as_its_volume() {
    for (_, format) in FORMATS {
        format(300, 1);
    }
}

#[test]
#[ignore = "minutes: ten thousand files a format"]
fn ten_thousand_headers_of_each_format() {
    let cases = std::env::var("BONEPD_HEADER_CASES")
        .ok()
        .and_then(|v| v.parse().ok());
    let cases = cases.unwrap_or(10_000);
    for (name, format) in FORMATS {
        let start = std::time::Instant::now();
        format(cases, 2);
        println!(
            "{name}: {cases} files read as they were written, {:.0} s",
            start.elapsed().as_secs_f64()
        );
    }
}
