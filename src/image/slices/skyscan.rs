//! Owns the voxel size in the logs that SkyScan's NRecon writes next to its slices.
//!
//! A log has sections (`[Reconstruction]`) and lines `key=value`. The scanner's own log, of projections, lies next to the slices
//! at times, too: the reconstruction's counts. Keys, and what becomes of each; any other does not change what a voxel is. A
//! test of the repository reads this table and tries every row.
//!
//! | section | key | what becomes of it |
//! |---|---|---|
//! | Reconstruction | Pixel Size (um) | read: the last one counts |
//! | Reconstruction | Section to Section Step | read: distance of slices in pixels |
//! | Reconstruction | Result Image Width (pixels) | said: where the slices have others |
//! | Reconstruction | Result Image Height (pixels) | said: where the slices have others |
//! | Reconstruction | First Section | harmless |
//! | Reconstruction | Last Section | harmless |
//! | Reconstruction | Sections Count | harmless |
//! | Reconstruction | Minimum for CS to Image Conversion | harmless: grey values are as stored |
//! | Reconstruction | Maximum for CS to Image Conversion | harmless: grey values are as stored |
//! | Acquisition | Image Pixel Size (um) | read: where no log is a reconstruction's, with a note |
//! | Acquisition | Scaled Image Pixel Size (um) | harmless: of the projections on the screen |
//! | System | Camera Pixel Size (um) | harmless: of the camera |

use crate::format::raw;
use std::path::{Path, PathBuf};

/// What a log says of the voxels.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Log {
    pub name: String,
    /// From a reconstruction; else of projections.
    reconstructed: bool,
    pub pixel_mm: Option<f64>,
    /// Distance of slices in pixels.
    pub step: Option<f64>,
    /// Pixels of a reconstructed slice.
    pub result: [Option<usize>; 2],
}

/// The log that belongs to the slices of which `slice` is one, and what is to be said of the choice.
pub fn log_of(folder: &Path, slice: &Path, notes: &mut Vec<String>) -> Option<Log> {
    let mut logs: Vec<Log> = paths(folder).iter().filter_map(|p| read(p)).collect();
    let any = logs.iter().any(|log| log.reconstructed);
    logs.retain(|log| log.reconstructed == any && log.pixel_mm.is_some());
    let name = lower_name(slice);
    let begins = |log: &Log| name.starts_with(log.name.trim_end_matches(".log"));
    let chosen = logs
        .iter()
        .filter(|log| begins(log))
        .max_by_key(|log| log.name.len())
        .or(logs.first())?
        .clone();
    let same = |log: &Log| (log.pixel_mm, log.step) == (chosen.pixel_mm, chosen.step);
    if !logs.iter().all(same) {
        if !begins(&chosen) {
            notes.push("the logs next to the slices give several voxel sizes, and no log has the slices' name: none is used".into());
            return None;
        }
        notes.push(format!(
            "there are several logs next to the slices: the voxel size is that of {}, which has their name",
            chosen.name
        ));
    }
    if !any {
        notes.push("the log next to the slices is of the scan, not of a reconstruction: its pixel size is that of the projections".into());
    }
    Some(chosen)
}

fn paths(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let mut logs: Vec<PathBuf> = entries
        .filter_map(|e| e.ok())
        .map(|e| e.path())
        .filter(|p| lower_name(p).ends_with(".log"))
        .collect();
    logs.sort();
    logs
}

fn lower_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().to_lowercase()
}

fn read(path: &Path) -> Option<Log> {
    let text = raw::head(path, 1 << 20).ok()?;
    let log = parse(&String::from_utf8_lossy(&text));
    Some(Log {
        name: lower_name(path),
        ..log
    })
}

fn parse(text: &str) -> Log {
    let mut log = Log::default();
    let mut section = "reconstruction".to_owned();
    let (mut reconstructed, mut scanned) = (None, None);
    for line in text.lines().map(str::trim) {
        if let Some(name) = line.strip_prefix('[').and_then(|l| l.strip_suffix(']')) {
            section = name.trim().to_lowercase();
            continue;
        }
        let Some((key, value)) = line.split_once('=') else {
            continue;
        };
        let number: Option<f64> = value.trim().parse().ok();
        let number = number.filter(|v| v.is_finite() && *v > 0.0);
        match (section.as_str(), key.trim().to_lowercase().as_str()) {
            ("reconstruction", "pixel size (um)") => reconstructed = number.or(reconstructed),
            ("reconstruction", "section to section step") => log.step = number,
            ("reconstruction", "result image width (pixels)") => {
                log.result[0] = number.map(|n| n as usize);
            }
            ("reconstruction", "result image height (pixels)") => {
                log.result[1] = number.map(|n| n as usize);
            }
            ("acquisition", "image pixel size (um)") => scanned = number.or(scanned),
            _ => {}
        }
    }
    log.reconstructed = reconstructed.is_some();
    log.pixel_mm = reconstructed.or(scanned).map(|um| um / 1000.0);
    log
}

impl Log {
    /// Voxel size of slices whose numbers go in steps of `numbers`, and what is to be said of it.
    pub fn spacing_mm(
        &self,
        numbers: u128,
        n: [usize; 2],
        notes: &mut Vec<String>,
    ) -> Option<[f64; 3]> {
        let pixel = self.pixel_mm?;
        let logged = self.step.unwrap_or(1.0);
        // Slices are numbered by their sections where some were left out, or one after the other.
        let step = logged.max(numbers as f64);
        notes.push(format!(
            "voxel size {pixel} mm from the reconstruction log next to the slices ({})",
            self.name
        ));
        if step != 1.0 {
            let why = match logged {
                1.0 => format!("the slices' numbers go in steps of {numbers}"),
                _ => format!("the log says Section to Section Step={logged}"),
            };
            notes.push(format!("slices are {step} pixels apart: {why}"));
        }
        if let [Some(width), Some(height)] = self.result
            && [width, height] != n
        {
            notes.push(format!(
                "the log says slices of {width} × {height} pixels, these have {} × {}: its pixel size holds if they were cropped, not if they were scaled",
                n[0], n[1]
            ));
        }
        Some([pixel, pixel, pixel * step])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RECONSTRUCTION: &str = "[System]\nCamera Pixel Size (um)=   9.0\n[Acquisition]\nImage Pixel Size (um)=   17.5\n[Reconstruction]\nPixel Size (um)=20\nSection to Section Step=2\n[CTAn]\nPixel Size (um)=99\n";

    #[test]
    fn only_the_reconstructions_pixel_counts() {
        let log = parse(RECONSTRUCTION);
        assert_eq!((log.pixel_mm, log.step), (Some(0.02), Some(2.0)));
        let mut notes = Vec::new();
        for numbers in [1, 2] {
            let size = log.spacing_mm(numbers, [10, 10], &mut notes);
            assert_eq!(size, Some([0.02, 0.02, 0.04]));
        }
        assert_eq!(parse("Pixel Size (um)=17.4\n").pixel_mm, Some(0.0174));
        let scan = parse("[Acquisition]\nCamera Pixel Size (um)=9\nImage Pixel Size (um)=17.5\n");
        assert_eq!((scan.pixel_mm, scan.reconstructed), (Some(0.0175), false));
    }

    #[test]
    fn the_log_with_the_slices_name_is_taken() {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
        let slice = dir.path().join("b_rec0001.bmp");
        let mut notes = Vec::new();
        let mut pixel = || log_of(dir.path(), &slice, &mut notes).and_then(|log| log.pixel_mm);
        write("a.log", "[Acquisition]\nImage Pixel Size (um)=17.5\n");
        assert_eq!(pixel(), Some(0.0175));
        write("b_rec.log", RECONSTRUCTION);
        assert_eq!(pixel(), Some(0.02));
        write("a_rec.log", "[Reconstruction]\nPixel Size (um)=30\n");
        assert_eq!(pixel(), Some(0.02));
        std::fs::rename(dir.path().join("b_rec.log"), dir.path().join("c_rec.log")).unwrap();
        assert_eq!(pixel(), None);
    }
}
