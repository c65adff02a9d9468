//! How often a run opens the files that it reads.

#![cfg(target_os = "linux")]

use crate::cli::run;
use crate::cohort::{cohort, text};
use inotify::{EventMask, Inotify, WatchDescriptor, WatchMask};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// What is opened in folders, counted by the kernel.
struct Opened {
    inotify: Inotify,
    folders: Vec<(WatchDescriptor, String)>,
}

impl Opened {
    fn watch(folders: &[(&Path, &str)]) -> Opened {
        let inotify = Inotify::init().unwrap();
        let watched = folders.iter().map(|(path, name)| {
            let descriptor = inotify.watches().add(path, WatchMask::OPEN).unwrap();
            (descriptor, (*name).to_owned())
        });
        Opened {
            folders: watched.collect(),
            inotify,
        }
    }

    /// How often each file was opened. Files are written under other names and renamed, so openings are readings.
    fn counts(mut self) -> BTreeMap<String, usize> {
        let mut counts = BTreeMap::new();
        let mut buffer = vec![0; 1 << 16];
        while let Ok(events) = self.inotify.read_events(&mut buffer) {
            for event in events {
                assert!(!event.mask.contains(EventMask::Q_OVERFLOW));
                let folder = self.folders.iter().find(|(watch, _)| *watch == event.wd);
                let file = event.name.map(|name| name.to_string_lossy().into_owned());
                if let (Some((_, folder)), Some(file)) = (folder, file) {
                    *counts.entry(format!("{folder}/{file}")).or_default() += 1;
                }
            }
        }
        counts
    }
}

/// Openings of the files of one scan while a recipe is run over it.
fn opened_by(recipe: &str) -> BTreeMap<String, usize> {
    let (dir, scans, file) = cohort(1);
    fs::write(&file, recipe).unwrap();
    let out = dir.path().join("out");
    fs::create_dir_all(out.join("s1")).unwrap();
    let opened = Opened::watch(&[(&scans, "scans"), (&out.join("s1"), "s1")]);
    let (code, _, said) = run(&["run", text(&file), text(&scans), "-o", text(&out)]);
    assert_eq!(code, 0, "{said}");
    opened.counts()
}

#[test]
fn a_run_reads_each_file_of_a_scan_once_whatever_it_solves() {
    // Two loads of two elements each; four lattices.
    let by_error = "loads = [\"uniaxial\", \"confined\"]\nerror = 0.2\n[segment]\nlower = 500.0\n";
    let lattices = "loads = [\"uniaxial\", \"confined\"]\n[segment]\nlower = 500.0\n[lattice]\nlp_mm = [0.15, 0.2]\n";
    for recipe in [by_error, lattices] {
        let counts = opened_by(recipe);
        println!("{counts:#?}");
        assert_eq!(counts["s1/mask.nii.gz"], 1, "{counts:#?}");
        // For its size, its hash, and its voxels; the last two at the same time.
        assert_eq!(counts["scans/s1.nii.gz"], 3, "{counts:#?}");
    }
}
