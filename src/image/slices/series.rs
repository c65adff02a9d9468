//! Owns which files of a folder are the slices of one scan, by the numbers in their names: one series, none missing.

use crate::error::{Error, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Slices in the order of their numbers.
#[derive(Debug, Clone)]
pub struct Series {
    pub files: Vec<PathBuf>,
    /// From one number to the next; 1 where the file is alone.
    pub step: u128,
}

/// A name without its extension, in lower case: what stands between its numbers, and the numbers.
struct Named {
    path: PathBuf,
    text: String,
    numbers: Vec<u128>,
}

/// Brings the files of a folder in the order of the one number that tells them apart. Other numbers may change along with it
/// (a position next to the slice's number); upper and lower case do not matter.
///
/// # Errors
/// Names of several series, two files of one number, numbers that are missing.
pub fn ordered(folder: &Path, files: Vec<PathBuf>) -> Result<Series> {
    if files.len() < 2 {
        return Ok(Series { files, step: 1 });
    }
    let mut named: Vec<Named> = files.into_iter().map(named).collect();
    let mut series: BTreeMap<&str, Vec<&Named>> = BTreeMap::new();
    for name in &named {
        series.entry(&name.text).or_default().push(name);
    }
    if series.len() > 1 {
        return Err(several(folder, series.values()));
    }
    let columns = 0..named[0].numbers.len();
    let varying: Vec<usize> = columns
        .filter(|&c| named.iter().any(|n| n.numbers[c] != named[0].numbers[c]))
        .collect();
    let mut gap = None;
    // The slice's number tends to stand last.
    for &column in varying.iter().rev() {
        named.sort_by_key(|name| name.numbers[column]);
        let steps = named.windows(2).map(|pair| {
            let [a, b] = [0, 1].map(|i| pair[i].numbers[column]);
            b - a
        });
        let Some(step @ 1..) = steps.clone().min() else {
            continue;
        };
        match steps.clone().position(|other| other != step) {
            None => {
                let files = named.into_iter().map(|name| name.path).collect();
                return Ok(Series { files, step });
            }
            Some(at) if gap.is_none() => gap = Some(missing(&named[at], &named[at + 1], column)),
            Some(_) => {}
        }
    }
    Err(gap.unwrap_or_else(|| doubled(folder, named, &varying)))
}

fn named(path: PathBuf) -> Named {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let stem = stem.to_lowercase();
    let (mut text, mut numbers) = (String::new(), Vec::new());
    let mut rest = stem.as_str();
    while !rest.is_empty() {
        let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
        let words = rest
            .bytes()
            .skip(digits)
            .take_while(|c| !c.is_ascii_digit());
        let (word, end) = (digits, digits + words.count());
        match rest[..word].parse() {
            Ok(number) => {
                numbers.push(number);
                text.push('0');
            }
            // No digits, or more than any number of a slice has: part of the text.
            Err(_) => text += &rest[..word],
        }
        text += &rest[word..end];
        rest = &rest[end..];
    }
    Named {
        path,
        text,
        numbers,
    }
}

fn file_name(name: &Named) -> String {
    let name = name.path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

fn several<'a>(folder: &Path, series: impl ExactSizeIterator<Item = &'a Vec<&'a Named>>) -> Error {
    let count = series.len();
    let words: Vec<String> = series
        .take(3)
        .map(|files| match files[..] {
            [only] => file_name(only),
            _ => format!("{} and {} like it", file_name(files[0]), files.len() - 1),
        })
        .collect();
    let more = if count > words.len() { ", …" } else { "" };
    Error::file(
        folder,
        format!(
            "holds slices of {count} series by their names: {}{more}",
            words.join(", ")
        ),
        "keep one scan in a folder: one name, and numbers that give the slices' order",
    )
}

fn missing(before: &Named, after: &Named, column: usize) -> Error {
    let [a, b] = [before, after].map(|name| name.numbers[column]);
    Error::file(
        &after.path,
        format!(
            "follows {}: between the numbers {a} and {b} slices are missing",
            file_name(before)
        ),
        "export the whole series; where slices were left out on purpose, renumber the rest and give --spacing",
    )
}

/// No number tells all files apart: one number twice, or several series that differ in another number.
fn doubled(folder: &Path, mut named: Vec<Named>, varying: &[usize]) -> Error {
    named.sort_by(|a, b| a.numbers.cmp(&b.numbers));
    let same = |pair: &&[Named]| pair[0].numbers == pair[1].numbers;
    if let Some([a, b]) = named.windows(2).find(same) {
        return Error::file(
            &b.path,
            format!("has the same number as {}", file_name(a)),
            "keep one file for each slice of the scan",
        );
    }
    let mut series: BTreeMap<u128, Vec<&Named>> = BTreeMap::new();
    for name in &named {
        let first = varying.first().map_or(0, |&column| name.numbers[column]);
        series.entry(first).or_default().push(name);
    }
    several(folder, series.values())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn order(names: &[&str]) -> std::result::Result<(Vec<String>, u128), String> {
        let files = names.iter().map(PathBuf::from).collect();
        let series = ordered(Path::new("folder"), files).map_err(|e| e.to_string())?;
        let names = series.files.iter().map(|p| p.to_string_lossy().into());
        Ok((names.collect(), series.step))
    }

    #[test]
    fn slices_follow_their_numbers_whatever_the_case() {
        let (names, step) =
            order(&["SCAN_10.TIF", "scan_9.tif", "Scan_011.tiff", "scan_8.tif"]).unwrap();
        assert_eq!(
            names,
            ["scan_8.tif", "scan_9.tif", "SCAN_10.TIF", "Scan_011.tiff"]
        );
        assert_eq!(step, 1);
        // The slice's number in the midst, and one that changes along with it.
        let (names, _) = order(&[
            "P12_s2_z40_2024.tif",
            "P12_s1_z25_2024.tif",
            "P12_s3_z60_2024.tif",
        ])
        .unwrap();
        assert_eq!(names[0], "P12_s1_z25_2024.tif");
        assert_eq!(order(&["a0.png", "a4.png", "a2.png"]).unwrap().1, 2);
        assert_eq!(order(&["alone.tif"]).unwrap().1, 1);
    }

    #[test]
    fn what_is_no_whole_series_is_refused() {
        for (names, said) in [
            (
                &["s1.tif", "s2.tif", "s4.tif"][..],
                "s4.tif: follows s2.tif: between the numbers 2 and 4",
            ),
            (
                &["s1.tif", "s2.tif", "t1.tif", "t2.tif"],
                "2 series by their names: s1.tif and 1 like it, t1.tif and 1 like it",
            ),
            (
                &["a1_1.tif", "a1_2.tif", "a2_1.tif", "a2_2.tif"],
                "2 series by their names: a1_1.tif",
            ),
            (&["s1.tif", "s2.tif", "preview.tif"], "preview.tif"),
            (
                &["s1.tif", "S01.tif", "s2.tif"],
                "S01.tif: has the same number as s1.tif",
            ),
            (
                &["s1.tif", "s1.tiff"],
                "s1.tiff: has the same number as s1.tif",
            ),
        ] {
            let words = order(names).unwrap_err();
            assert!(words.contains(said), "{names:?} said: {words}");
            assert!(words.contains("what to do"), "{words}");
        }
    }
}
