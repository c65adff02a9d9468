//! Owns manifests: a CSV or TSV with one line per scan, its path and what is special about it. Cells are divided by commas, or,
//! as spreadsheets and R's `write.csv2` have it where the comma is the decimal mark, by semicolons or tabs. Excel's first line
//! `sep=;` and empty columns at the end are passed over.

use crate::cohort::job::ScanJob;
use crate::error::{Error, Result};
use crate::image::scan;
use crate::pipeline::segment::SegmentParams;
use std::path::Path;

/// The columns a manifest may have; `path` it must. Empty cells and `NA` leave the recipe's setting.
const COLUMNS: [&str; 9] = [
    "path",
    "name",
    "subject",
    "group",
    "spacing_mm",
    "lower",
    "upper",
    "otsu",
    "gaussian_voxels",
];

/// What a manifest lists.
#[derive(Debug)]
pub struct Manifest {
    /// The scans, in the order of the lines.
    pub jobs: Vec<ScanJob>,
    /// Columns that mean nothing here, age and the like.
    pub unused: Vec<String>,
}

/// The scans of a manifest. Paths are relative to its folder.
pub fn read(path: &Path, params: &SegmentParams) -> Result<Manifest> {
    let wrong = |found: String| {
        Error::file(
            path,
            found,
            format!(
                "a manifest is a CSV with a header of these columns: {}",
                COLUMNS.join(", ")
            ),
        )
    };
    let text =
        std::fs::read(path).map_err(|e| wrong(format!("cannot be read: {e}")).caused_by(e))?;
    if let Err(e) = std::str::from_utf8(&text) {
        let line = 1 + text[..e.valid_up_to()]
            .iter()
            .filter(|b| **b == b'\n')
            .count();
        return Err(Error::file(
            path,
            format!(
                "line {line} is not UTF-8 text (names with accents may have been saved in another encoding)"
            ),
            "save it as UTF-8 (in Excel: Save as, CSV UTF-8; in R: fileEncoding = \"UTF-8\")",
        ));
    }
    let (said, rows) = without_separator_line(&text);
    let delimiter = said.unwrap_or_else(|| delimiter(rows));
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(rows);
    let header = reader
        .headers()
        .map_err(|e| wrong(format!("cannot be read: {e}")))?
        .clone();
    let header = without_empty_end(&header);
    let unused = unused_columns(&header).map_err(wrong)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut jobs = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| wrong(format!("cannot be read: {e}")))?;
        let line = record.position().map_or(0, csv::Position::line) + u64::from(said.is_some());
        if let Some(more) = record
            .iter()
            .skip(header.len())
            .find(|cell| !cell.is_empty())
        {
            return Err(wrong(format!(
                "line {line}: has more cells than the header has columns (`{more}`): put quotes around cells that hold a divider"
            )));
        }
        if record.iter().all(str::is_empty) {
            continue;
        }
        let cell = |column: &str| {
            let at = header.iter().position(|name| name == column)?;
            record
                .get(at)
                .filter(|cell| !cell.is_empty() && *cell != "NA")
        };
        let job = job(cell, delimiter, folder, params)
            .map_err(|found| wrong(format!("line {line}: {found}")))?;
        job.segment.check().map_err(|e| of_line(path, line, e))?;
        jobs.push(job);
    }
    if jobs.is_empty() {
        return Err(wrong("lists no scans".to_owned()));
    }
    Ok(Manifest { jobs, unused })
}

/// A setting that cannot be used, with the line of the manifest that gives it.
fn of_line(path: &Path, line: u64, e: Error) -> Error {
    match e {
        Error::Setting {
            key, found, advice, ..
        } => Error::file(path, format!("line {line}: {key}: {found}"), advice),
        other => other,
    }
}

/// What Excel's `sep=` in the first line says, and the text after it.
fn without_separator_line(text: &[u8]) -> (Option<u8>, &[u8]) {
    let bare = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let bare = bare.strip_prefix(b"\"").unwrap_or(bare);
    let Some(rest) = bare.strip_prefix(b"sep=").or(bare.strip_prefix(b"SEP=")) else {
        return (None, text);
    };
    let end = rest
        .iter()
        .position(|b| *b == b'\n')
        .map_or(rest.len(), |at| at + 1);
    match rest.first() {
        Some(&divider @ (b',' | b';' | b'\t' | b'|')) => (Some(divider), &rest[end..]),
        _ => (None, text),
    }
}

/// Spreadsheets save empty columns that once held something.
fn without_empty_end(header: &csv::StringRecord) -> csv::StringRecord {
    let names: Vec<&str> = header.iter().collect();
    let end = names
        .iter()
        .rposition(|name| !name.is_empty())
        .map_or(0, |last| last + 1);
    csv::StringRecord::from(&names[..end])
}

/// What divides the cells of the header.
fn delimiter(text: &[u8]) -> u8 {
    let header = text.split(|b| *b == b'\n').next().unwrap_or_default();
    let other = [b';', b'\t'].into_iter().find(|d| header.contains(d));
    match other {
        Some(other) if !header.contains(&b',') => other,
        _ => b',',
    }
}

/// Columns that are none of [`COLUMNS`]. One that is spelt nearly like them is refused.
fn unused_columns(header: &csv::StringRecord) -> std::result::Result<Vec<String>, String> {
    let mut unused = Vec::new();
    for name in header {
        if !COLUMNS.contains(&name) {
            let nearest = COLUMNS.iter().max_by(|a, b| {
                strsim::jaro_winkler(name, a).total_cmp(&strsim::jaro_winkler(name, b))
            });
            // Words that are not alike are no help.
            let alike = nearest.filter(|best| strsim::jaro_winkler(name, best) > 0.75);
            match alike {
                Some(best) => {
                    return Err(format!("unknown column `{name}`; did you mean `{best}`?"));
                }
                None => unused.push(name.to_owned()),
            }
        }
    }
    match header.iter().any(|name| name == "path") {
        true => Ok(unused),
        false if header.iter().any(|name| name == "e_app_mpa") => {
            Err("is a table of results, where a manifest of scans was expected".to_owned())
        }
        false => Err("has no column `path`".to_owned()),
    }
}

fn job<'a>(
    cell: impl Fn(&str) -> Option<&'a str>,
    delimiter: u8,
    folder: &Path,
    params: &SegmentParams,
) -> std::result::Result<ScanJob, String> {
    let number = |column: &str| {
        let word = cell(column);
        word.map(|word| parsed(word, column, delimiter)).transpose()
    };
    let input = folder.join(cell("path").ok_or("no path")?);
    let mut segment = params.clone();
    let (lower, upper) = (number("lower")?, number("upper")?);
    if lower.is_some() || upper.is_some() {
        segment.lower = lower.or(segment.lower);
        segment.upper = upper.or(segment.upper);
        segment.otsu = false;
    }
    match cell("otsu") {
        Some("true" | "TRUE" | "1" | "yes") => {
            (segment.otsu, segment.lower, segment.upper) = (true, None, None);
        }
        None | Some("false" | "FALSE" | "0" | "no") => {}
        Some(other) => return Err(format!("expected true or false in `otsu`, found `{other}`")),
    }
    if let Some(word) = cell("spacing_mm") {
        segment.spacing_mm = Some(spacing(word, delimiter)?);
    }
    segment.gaussian_voxels = number("gaussian_voxels")?.unwrap_or(segment.gaussian_voxels);
    let text = |column| cell(column).map(str::to_owned);
    Ok(ScanJob {
        name: text("name").unwrap_or_else(|| scan::name(&input)),
        input,
        segment,
        group: text("group"),
        subject: text("subject"),
    })
}

/// A number in the spelling of the file: with a decimal comma where columns are separated by semicolons or tabs.
fn parsed(word: &str, column: &str, delimiter: u8) -> std::result::Result<f64, String> {
    // 1.200 between semicolons is 1200 in the countries that save so, and 1.2 in all others.
    let (head, tail) = word.split_once('.').unwrap_or((word, ""));
    let digits = |text: &str| text.bytes().all(|c| c.is_ascii_digit());
    let head = head.trim_start_matches(['-', '+']);
    if delimiter == b';'
        && tail.len() == 3
        && digits(tail)
        && digits(head)
        && !head.starts_with('0')
        && !head.is_empty()
    {
        return Err(format!(
            "`{word}` in `{column}` may mean {head}{tail} or {head}.{}: between semicolons a point can divide thousands. Write it without one, or with a decimal comma",
            tail.trim_end_matches('0')
        ));
    }
    let number = match delimiter {
        b',' => word.parse::<f64>(),
        _ => word.replace(',', ".").parse(),
    };
    match number {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err(format!("expected a number in `{column}`, found `{word}`")),
    }
}

/// One voxel size for all axes, or three: divided by commas (quoted), spaces, semicolons or `x`.
fn spacing(word: &str, delimiter: u8) -> std::result::Result<[f64; 3], String> {
    let decimal_comma = delimiter != b',' && !word.contains('.');
    let divides = |c: char| c.is_whitespace() || "x×;".contains(c) || c == ',' && !decimal_comma;
    let parts: Vec<&str> = word
        .split(divides)
        .filter(|part| !part.is_empty())
        .collect();
    let number = |word: &str| parsed(word, "spacing_mm", delimiter);
    match parts[..] {
        [one] => Ok([number(one)?; 3]),
        [x, y, z] => Ok([number(x)?, number(y)?, number(z)?]),
        _ => Err(format!(
            "expected one voxel size or three (x, y, z) in `spacing_mm`, found `{word}`"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<Vec<ScanJob>> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cohort.csv");
        std::fs::write(&path, text).unwrap();
        let params = SegmentParams {
            lower: Some(5.0),
            upper: Some(2000.0),
            ..SegmentParams::default()
        };
        let jobs = read(&path, &params)?.jobs;
        assert!(jobs[0].input.starts_with(dir.path()));
        Ok(jobs)
    }

    #[test]
    fn each_line_is_a_scan_with_its_own_settings() {
        let jobs = read_text(
            "path, group, lower, spacing_mm, name\nscans/a.nii, OA, 200, 0.02, first\nscans/b.nii, NA, , , \n",
        )
        .unwrap();
        assert_eq!(jobs.len(), 2);
        assert_eq!(
            (jobs[0].name.as_str(), jobs[1].name.as_str()),
            ("first", "b")
        );
        assert_eq!(
            (jobs[0].group.as_deref(), &jobs[1].group),
            (Some("OA"), &None)
        );
        assert_eq!(
            (jobs[0].segment.lower, jobs[1].segment.lower),
            (Some(200.0), Some(5.0))
        );
        assert_eq!(
            (jobs[0].segment.spacing_mm, jobs[1].segment.spacing_mm),
            (Some([0.02; 3]), None)
        );
    }

    #[test]
    fn spreadsheets_of_other_countries_are_understood() {
        let text = "path;spacing_mm;lower\r\na.nii;0,0195;200,5\r\nb.nii;0.02;\r\n";
        // Some spreadsheets mark their files as UTF-8.
        for text in [
            text.to_owned(),
            text.replace(';', "\t"),
            format!("\u{feff}{text}"),
        ] {
            let jobs = read_text(&text).unwrap();
            let spacings = jobs.iter().map(|job| job.segment.spacing_mm);
            assert!(
                spacings.eq([Some([0.0195; 3]), Some([0.02; 3])]),
                "{jobs:?}"
            );
            assert_eq!(jobs[0].segment.lower, Some(200.5));
        }
        let words = read_text("path;lower\na.nii;1.200,5\n").unwrap_err();
        assert!(words.to_string().contains("found `1.200,5`"), "{words}");
    }

    #[test]
    fn files_are_read_as_people_save_them() {
        for (text, spacing) in [
            ("sep=;\r\npath;spacing_mm\r\na.nii;0,0195\r\n", [0.0195; 3]),
            (
                "\u{feff}sep=,\npath,spacing_mm\na.nii,0.0195\n",
                [0.0195; 3],
            ),
            ("path,spacing_mm,,\na.nii,0.0195,,\n,,,\n", [0.0195; 3]),
            (
                "path,spacing_mm\na.nii,\"0.02,0.02,0.04\"\n",
                [0.02, 0.02, 0.04],
            ),
            (
                "path,spacing_mm\na.nii,0.02 0.02 0.04\n",
                [0.02, 0.02, 0.04],
            ),
            (
                "path;spacing_mm\na.nii;0,02 x 0,02 x 0,04\n",
                [0.02, 0.02, 0.04],
            ),
            ("path\tspacing_mm\na.nii\t0.02\n", [0.02; 3]),
        ] {
            let jobs = read_text(text).unwrap();
            assert_eq!(
                (jobs.len(), jobs[0].segment.spacing_mm),
                (1, Some(spacing)),
                "{text:?}"
            );
        }
    }

    #[test]
    fn what_may_mean_two_numbers_is_refused() {
        for word in ["1.200", "-1.200", "12.000"] {
            let words = read_text(&format!("path;lower\na.nii;{word}\n")).unwrap_err();
            assert!(words.to_string().contains("may mean"), "{words}");
        }
        let lower = |text: &str| read_text(text).unwrap()[0].segment.lower;
        assert_eq!(lower("path;lower\na.nii;0.195\n"), Some(0.195));
        assert_eq!(lower("path;lower\na.nii;1.25\n"), Some(1.25));
        assert_eq!(lower("path\tlower\na.nii\t1.200\n"), Some(1.2));
        let words = read_text("path,lower\na.nii,0,0195\n")
            .unwrap_err()
            .to_string();
        assert!(words.contains("line 2: has more cells"), "{words}");
    }

    #[test]
    fn an_empty_cell_leaves_the_recipes_window() {
        let jobs = read_text("path,lower,upper\na.nii,,900\nb.nii,7,NA\n").unwrap();
        let windows = jobs
            .iter()
            .map(|job| (job.segment.lower, job.segment.upper));
        assert_eq!(
            windows.collect::<Vec<_>>(),
            [(Some(5.0), Some(900.0)), (Some(7.0), Some(2000.0))]
        );
    }

    #[test]
    fn another_encoding_is_told_with_its_line() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cohort.csv");
        // As Excel saves `CSV` in western Europe.
        std::fs::write(&path, b"path,group\na.nii,OA\nb.nii,gr\xfcn\n").unwrap();
        let words = read(&path, &SegmentParams::default())
            .unwrap_err()
            .to_string();
        assert!(
            words.contains("line 3") && words.contains("save it as UTF-8"),
            "{words}"
        );
    }

    #[test]
    fn columns_that_mean_nothing_here_are_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cohort.csv");
        std::fs::write(&path, "path,age,sex,group\na.nii,71,f,OA\n").unwrap();
        let manifest = read(&path, &SegmentParams::default()).unwrap();
        assert_eq!(manifest.unused, ["age", "sex"]);
        assert_eq!(manifest.jobs[0].group.as_deref(), Some("OA"));
    }

    #[test]
    fn a_manifest_that_cannot_be_meant_is_said() {
        for (text, said) in [
            ("path,grup\na.nii,x\n", "did you mean `group`"),
            ("name\na\n", "no column `path`"),
            ("path,lower\na.nii,high\n", "line 2"),
            ("path,lower\n", "lists no scans"),
            (
                "path,lower,upper\na.nii,1,3\nb.nii,9,3\n",
                "cohort.csv: line 3: segment.lower: lower 9 lies above upper 3",
            ),
        ] {
            let words = read_text(text).unwrap_err().to_string();
            assert!(words.contains(said), "{text:?} said: {words}");
        }
    }
}
