//! Every reader against malformed files: damaged headers, truncated data, sizes that lie, wrong magic. No panic, and no
//! memory beyond what the file can hold.
//!
//! Default: a few hundred files of each kind. A long run, `BONEPD_FUZZ_CASES` of each kind (default 36 000, over a million in
//! all), from other random numbers with another `BONEPD_FUZZ_SEED`; only of kinds whose name holds `BONEPD_FUZZ_KIND`:
//!
//!     cargo test --release --test all -- --ignored --nocapture fuzz::a_million

mod allocation;
mod damage;
mod headers;
mod samples;

use bonepd_ct::cohort::scans;
use bonepd_ct::cohort::scans::Selection;
use bonepd_ct::command::{estimate, info};
use bonepd_ct::image::{extent, scan};
use bonepd_ct::io::table;
use bonepd_ct::machine::session::Session;
use bonepd_ct::recipe::Recipe;
use bonepd_ct::result::row::Row;
use damage::{damaged, faults};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use samples::{Sample, samples};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

#[global_allocator]
static ALLOCATOR: allocation::Counting = allocation::Counting;

/// Bytes a reader may hold for a file. Deflate expands at most 1032 times and TIFF's codecs 2000 times; bytes become floats
/// (4), beside the decoded bytes (1). Buffers of fixed size add up to less than the constant.
fn bound(file_bytes: usize) -> usize {
    (8 << 20) + 10_000 * file_bytes
}

/// What is said of a file: read or refused, and what was held for it at most.
struct Found {
    read: bool,
    peak: usize,
}

/// Everything that is done with an input before it is solved.
fn take(target: &Path, spacing_mm: Option<[f64; 3]>) -> bool {
    let name = target.file_name().unwrap().to_str().unwrap();
    match name {
        "manifest.csv" | "manifest.tsv" => {
            let session = Session {
                quiet: true,
                ..Session::default()
            };
            let inputs = [target.to_path_buf()];
            let params = Default::default();
            return scans::find(&inputs, &params, &Selection::default(), &session).is_ok();
        }
        "results.csv" => return table::read::<Row>(target).is_ok(),
        "recipe.toml" => {
            let text = std::fs::read(target).unwrap();
            return Recipe::parse(&String::from_utf8_lossy(&text), target).is_ok();
        }
        _ => {}
    }
    let needs = estimate::estimate(target, spacing_mm, &Recipe::default()).unwrap();
    assert!(needs.memory_mib > 0.0, "{needs:?}");
    let _ = extent::of(target);
    let _ = info::info(target);
    let read = scan::read(target, spacing_mm);
    if let Ok(scan) = &read {
        let grid = scan.volume.grid;
        assert_eq!(grid.len(), scan.volume.as_slice().len());
        assert!(!grid.is_empty(), "an empty scan was read");
        assert!(
            grid.spacing_mm.iter().all(|h| h.is_finite() && *h > 0.0),
            "voxel size {:?}",
            grid.spacing_mm
        );
    }
    read.is_ok()
}

/// Writes a file and takes it in.
fn attempt(dir: &Path, sample: &Sample, bytes: &[u8], spacing: bool) -> Found {
    let path = dir.join(sample.name);
    std::fs::write(&path, bytes).unwrap();
    let target = if sample.name.contains('/') {
        path.parent().unwrap().to_path_buf()
    } else {
        path
    };
    let (read, peak) = allocation::peak_of(|| take(&target, spacing.then_some([0.02; 3])));
    Found { read, peak }
}

fn folder_of(sample: &Sample) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let beside = sample.beside.iter().map(|(name, bytes)| (*name, bytes));
    for (name, bytes) in beside.chain([(sample.name, &sample.bytes)]) {
        let path = dir.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    dir
}

/// Counts of one kind of file.
#[derive(Default)]
struct Sum {
    refused: usize,
    peak: usize,
}

/// Tries `cases` damaged copies of a sample; the smallest failing one is in the panic's message.
fn try_sample(sample: &Sample, other: &Sample, cases: u32, seed: u64) -> Sum {
    let dir = folder_of(sample);
    let sum = Mutex::new(Sum::default());
    let config = Config {
        cases,
        failure_persistence: None,
        ..Config::default()
    };
    let mut seeds = [0u8; 32];
    seeds[..8].copy_from_slice(&seed.to_le_bytes());
    let random = TestRng::from_seed(RngAlgorithm::ChaCha, &seeds);
    let mut runner = TestRunner::new_with_rng(config, random);
    let result = runner.run(&(faults(), any::<bool>()), |(faults, spacing)| {
        let bytes = damaged(&sample.bytes, &faults, &other.bytes);
        let found = attempt(dir.path(), sample, &bytes, spacing);
        let beside: usize = sample.beside.iter().map(|(_, bytes)| bytes.len()).sum();
        let allowed = bound(bytes.len() + beside);
        prop_assert!(
            found.peak < allowed,
            "{} bytes held, {allowed} allowed for a file of {}",
            found.peak,
            bytes.len()
        );
        let mut sum = sum.lock().unwrap();
        sum.refused += usize::from(!found.read);
        sum.peak = sum.peak.max(found.peak);
        Ok(())
    });
    if let Err(e) = result {
        panic!("{}: {e}", sample.name);
    }
    sum.into_inner().unwrap()
}

/// All samples, two at a time, each on a pool of one thread so that its allocations are counted there.
fn try_all(cases: u32, seed: u64) {
    let only = std::env::var("BONEPD_FUZZ_KIND").unwrap_or_default();
    let mut samples = samples();
    samples.retain(|sample| sample.name.contains(&only));
    let (next, failed) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        pool.unwrap().install(|| {
            loop {
                let i = next.fetch_add(1, Ordering::Relaxed);
                let Some(sample) = samples.get(i) else {
                    return;
                };
                let other = &samples[(i + 1) % samples.len()];
                let tried = std::panic::catch_unwind(|| try_sample(sample, other, cases, seed));
                match tried {
                    Ok(sum) => {
                        println!(
                            "{}: {cases} damaged files, {} refused, {:.1} MiB at most",
                            sample.name,
                            sum.refused,
                            sum.peak as f64 / f64::from(1 << 20)
                        );
                        // A damage that no reader notices tests nothing. Text may say something else and still be sound.
                        let least = if sample.is_table() { 100 } else { 10 };
                        if sum.refused * least < cases as usize {
                            failed.lock().unwrap().push(format!(
                                "{}: only {} of {cases} refused",
                                sample.name, sum.refused
                            ));
                        }
                    }
                    Err(words) => failed.lock().unwrap().push(
                        words
                            .downcast_ref::<String>()
                            .cloned()
                            .unwrap_or_else(|| sample.name.to_owned()),
                    ),
                }
            }
        });
    };
    std::thread::scope(|scope| {
        scope.spawn(work);
        scope.spawn(work);
    });
    let failed = failed.into_inner().unwrap();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
    println!("{} damaged files in all", samples.len() * cases as usize);
}

fn number(variable: &str, default: u64) -> u64 {
    let set = std::env::var(variable).ok();
    set.and_then(|v| v.parse().ok()).unwrap_or(default)
}

#[test]
fn the_readme_counts_the_kinds_of_files() {
    let readme = include_str!("../README.md");
    let said = format!("damaged files of {} kinds", samples().len());
    assert!(readme.contains(&said), "README.md does not say: {said}");
}

#[test]
fn sound_samples_are_read() {
    for sample in samples() {
        let dir = folder_of(&sample);
        let found = attempt(dir.path(), &sample, &sample.bytes, true);
        assert!(found.read, "{}", sample.name);
    }
}

#[test]
fn damaged_files_are_refused_or_read_never_a_panic_nor_runaway_memory() {
    try_all(250, 1);
}

#[test]
#[ignore = "minutes: a million files"]
fn a_million_damaged_files() {
    let cases = u32::try_from(number("BONEPD_FUZZ_CASES", 36_000)).unwrap();
    try_all(cases, number("BONEPD_FUZZ_SEED", 2));
}

#[test]
fn files_under_a_wrong_name_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let samples = samples();
    let single = |s: &&Sample| s.beside.is_empty() && !s.name.ends_with("sv");
    for (a, b) in samples.iter().filter(single).flat_map(|a| {
        let others = samples.iter().filter(single);
        others.map(move |b| (a, b))
    }) {
        let end = |s: &Sample| PathBuf::from(s.name).extension().unwrap().to_owned();
        let path = dir.path().join("a").with_extension(end(b));
        // Whether a NIfTI file is compressed is told by its first bytes, not by its name.
        let unpacked = a.name == "a.nii.gz" && end(b) == "nii";
        // So is a DICOM file, where its name says nothing else.
        let unnamed = a.name.ends_with(".dcm") && end(b) == "gz";
        if end(a) == end(b) || end(b) == "toml" || unpacked || unnamed {
            continue;
        }
        std::fs::write(&path, &a.bytes).unwrap();
        assert!(
            scan::read(&path, Some([0.02; 3])).is_err(),
            "{} was read as {}",
            a.name,
            path.display()
        );
    }
}
