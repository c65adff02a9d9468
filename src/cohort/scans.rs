//! Owns which scans a run is over: files, folders that are one scan, folders of scans, manifests.

use crate::cohort::job::ScanJob;
use crate::cohort::manifest;
use crate::error::{Error, Result};
use crate::image::{extent, scan, slices};
use crate::io::own_files;
use crate::machine::session::Session;
use crate::pipeline::segment::SegmentParams;
use crate::record::specimen;
use glob::Pattern;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Which scans of a folder.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    /// Into folders of folders.
    pub recursive: bool,
    /// Only scans whose file or folder name matches (`*` and `?`).
    pub pattern: Option<Pattern>,
}

/// The scans under `inputs`, each with the recipe's settings or its manifest's.
///
/// # Errors
/// An input that is not there, a folder without scans, two scans of one name.
pub fn find(
    inputs: &[PathBuf],
    params: &SegmentParams,
    selection: &Selection,
    session: &Session,
) -> Result<Vec<ScanJob>> {
    let mut jobs = Vec::new();
    for input in inputs {
        if is_manifest(input) {
            let manifest = manifest::read(input, params)?;
            if !manifest.unused.is_empty() {
                session.warn(format!(
                    "{}: columns that are not used: {}",
                    input.display(),
                    manifest.unused.join(", ")
                ));
            }
            jobs.extend(manifest.jobs);
            continue;
        }
        let found = scans_under(input, selection, session)?;
        jobs.extend(found.into_iter().map(|(name, input)| ScanJob {
            name,
            input,
            segment: params.clone(),
            group: None,
            subject: None,
        }));
    }
    refuse_names(&jobs)?;
    refuse_doubles(&jobs)?;
    Ok(jobs)
}

/// The one scan of a name: one job of many on a cluster.
///
/// # Errors
/// No scan of this name.
pub fn only(jobs: &[ScanJob], name: &str) -> Result<Vec<ScanJob>> {
    match jobs.iter().find(|job| job.name == name) {
        Some(job) => Ok(vec![job.clone()]),
        None => Err(Error::setting(
            "--only",
            format!("no scan is named {name}"),
            "list the names with --dry-run",
        )),
    }
}

fn is_manifest(path: &Path) -> bool {
    path.is_file()
        && path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("csv") || e.eq_ignore_ascii_case("tsv"))
}

/// Refuses a folder that holds whole scans where one scan was expected.
///
/// # Errors
/// With how many it holds.
pub fn refuse_many(input: &Path) -> Result<()> {
    if !input.is_dir() || is_one_scan(input) {
        return Ok(());
    }
    refuse_results(input)?;
    let mut found = Vec::new();
    descend(input, &Selection::default(), "", &mut found)?;
    match found.first() {
        None => Ok(()),
        Some((_, first)) => Err(Error::file(
            input,
            format!("holds {} scans, where one was expected", found.len()),
            format!(
                "name one of them, as {}, or take them all: bonepd-ct run RECIPE {} -o OUT",
                first.display(),
                input.display()
            ),
        )),
    }
}

/// Files that a command of this program leaves in a folder of results.
const RESULTS: [&str; 3] = [own_files::RECORD, own_files::RESULTS, "report.html"];

/// Whether a folder holds results of this program.
fn holds_results(folder: &Path) -> bool {
    RESULTS.iter().any(|name| folder.join(name).is_file())
}

/// A file that is a scan, and none that this program left.
fn is_scan(file: &Path) -> bool {
    scan::is_scan_file(file) && !own_files::is_result(file)
}

/// A folder of results with no scan next to them.
fn refuse_results(input: &Path) -> Result<()> {
    let has_scans = || listing(input).is_ok_and(|files| files.iter().any(|f| is_scan(f)));
    match input.is_dir() && holds_results(input) && !has_scans() {
        true => Err(Error::file(
            input,
            "is a folder of results, where a scan was expected",
            "give the scan itself; `report` takes folders of results, `solve` that of a segmented scan",
        )),
        false => Ok(()),
    }
}

/// Names and paths of the scans that `input` is or holds.
fn scans_under(
    input: &Path,
    selection: &Selection,
    session: &Session,
) -> Result<Vec<(String, PathBuf)>> {
    let is_scan = is_one_scan(input);
    // Results may lie next to the scans they are of.
    if is_scan || input.join(specimen::RECORD).is_file() {
        refuse_results(input)?;
    }
    if !input.is_dir() || is_scan {
        return Ok(vec![(scan::name(input), input.to_path_buf())]);
    }
    let mut found = Vec::new();
    descend(input, selection, "", &mut found)?;
    if let Some(pattern) = &selection.pattern {
        found.retain(|(_, path)| {
            path.file_name()
                .is_some_and(|name| pattern.matches(&name.to_string_lossy()))
        });
    }
    if found.is_empty() {
        if [own_files::RECORD, own_files::ANSWERS]
            .iter()
            .any(|name| input.join(name).is_file())
        {
            return Err(Error::file(
                input,
                "is a folder of results, where scans were expected",
                "give the scans; `bonepd-ct report` and `bonepd-ct solve` read folders of results",
            ));
        }
        let wanted = selection
            .pattern
            .as_ref()
            .map_or(String::new(), |p| format!(" that match {p}"));
        return Err(Error::file(
            input,
            format!("holds no scans{wanted}"),
            "give a scan, or a folder with scans; --recursive looks into folders of folders",
        ));
    }
    session.detail(format!("{}: {} scans", input.display(), found.len()));
    Ok(found)
}

/// A folder of single slices and no whole scans.
fn is_one_scan(folder: &Path) -> bool {
    let Ok(files) = listing(folder) else {
        return false;
    };
    let slices: Vec<&PathBuf> = files.iter().filter(|f| slices::is_slice(f)).collect();
    let whole = |f: &&PathBuf| scan::is_scan_file(f) && !slices::is_slice(f);
    !slices.is_empty() && !files.iter().any(|f| whole(&f)) && !extent::is_stack(slices[0])
}

/// Whether the pictures of a folder may be slices of one scan: of one size. Figures next to scans are of many.
fn are_slices(folder: &Path) -> bool {
    let Ok(files) = listing(folder) else {
        return true;
    };
    let picture = |f: &PathBuf| {
        f.extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("png") || e.eq_ignore_ascii_case("bmp"))
    };
    let mut sizes = files
        .iter()
        .filter(|f| slices::is_slice(f) && picture(f))
        .filter_map(|f| image::image_dimensions(f).ok());
    match sizes.next() {
        Some(first) => sizes.all(|size| size == first),
        None => true,
    }
}

fn listing(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).and_then(|entries| {
        let paths = entries.map(|entry| entry.map(|e| e.path()));
        paths.collect::<std::io::Result<Vec<PathBuf>>>()
    });
    let mut paths = entries.map_err(|e| {
        Error::file(
            folder,
            format!("cannot be listed: {e}"),
            "check the folder and its permissions",
        )
        .caused_by(e)
    })?;
    let hidden = |p: &Path| {
        p.file_name()
            .is_some_and(|n| n.to_string_lossy().starts_with('.'))
    };
    paths.retain(|p| !hidden(p));
    let name = |p: &Path| p.to_string_lossy().into_owned();
    paths.sort_by(|a, b| slices::natural(&name(a), &name(b)));
    Ok(paths)
}

/// Scans in `folder`, results of earlier runs aside; names are prefixed with the folders on the way, so that they stay the same whatever else is there.
fn descend(
    folder: &Path,
    selection: &Selection,
    prefix: &str,
    found: &mut Vec<(String, PathBuf)>,
) -> Result<()> {
    for path in listing(folder)? {
        let name = format!("{prefix}{}", scan::name(&path));
        let whole = path.is_file() && scan::is_scan_file(&path) && !own_files::is_result(&path);
        let single_page = slices::is_slice(&path) && !extent::is_stack(&path);
        if path.is_dir() && holds_results(&path) {
            continue;
        }
        if whole && !single_page || path.is_dir() && is_one_scan(&path) && are_slices(&path) {
            found.push((name, path));
        } else if path.is_dir() && selection.recursive {
            descend(&path, selection, &format!("{name}_"), found)?;
        }
    }
    Ok(())
}

/// Names become folders next to the run's own files.
fn refuse_names(jobs: &[ScanJob]) -> Result<()> {
    const OWN: [&str; 6] = [
        "report",
        own_files::RESULTS,
        own_files::ANSWERS,
        own_files::RECIPE,
        own_files::OLD_RECIPE,
        own_files::FAILED,
    ];
    let path_like = |name: &str| name.contains(['/', '\\', '\0']) || [".", ".."].contains(&name);
    for job in jobs {
        let name = job.name.as_str();
        if name.is_empty() || path_like(name) || OWN.contains(&name.to_lowercase().as_str()) {
            return Err(Error::specimen(
                format!("a scan cannot be named `{name}` ({})", job.input.display()),
                "rename it, or list it in a manifest (CSV) with a column `name`: no slashes, and not the name of one of the run's own files",
            ));
        }
    }
    Ok(())
}

fn refuse_doubles(jobs: &[ScanJob]) -> Result<()> {
    let mut seen: HashMap<String, &ScanJob> = HashMap::new();
    for job in jobs {
        // Folder names that differ in case only are one folder on some systems.
        if let Some(other) = seen.insert(job.name.to_lowercase(), job) {
            return Err(Error::specimen(
                format!(
                    "two scans are named {}: {} and {}",
                    job.name,
                    other.input.display(),
                    job.input.display()
                ),
                "rename one, or give each a name of its own in the column `name` of a manifest (CSV)",
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn find_names(inputs: &[PathBuf], selection: &Selection) -> Result<Vec<String>> {
        let session = Session {
            quiet: true,
            ..Session::default()
        };
        let jobs = find(inputs, &SegmentParams::default(), selection, &session)?;
        Ok(jobs.into_iter().map(|job| job.name).collect())
    }

    /// Empty files: names decide what is a scan, reading it comes later.
    fn tree(files: &[&str]) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        for file in files {
            let path = dir.path().join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        dir
    }

    #[test]
    fn a_folder_of_slices_is_one_scan_a_folder_of_files_is_many() {
        let dir = tree(&[
            "s10/a1.tif",
            "s10/a2.tif",
            "s2.nii.gz",
            "s1.nii",
            "notes.txt",
            "deep/s3.nii",
        ]);
        let root = dir.path().to_path_buf();
        let plain = Selection::default();
        assert_eq!(
            find_names(std::slice::from_ref(&root), &plain).unwrap(),
            ["s1", "s2", "s10"]
        );
        assert_eq!(find_names(&[root.join("s10")], &plain).unwrap(), ["s10"]);
        let deep = Selection {
            recursive: true,
            ..Selection::default()
        };
        assert_eq!(
            find_names(std::slice::from_ref(&root), &deep).unwrap(),
            ["deep_s3", "s1", "s2", "s10"]
        );
        let gz = Selection {
            recursive: true,
            pattern: Some(Pattern::new("*.gz").unwrap()),
        };
        assert_eq!(find_names(&[root], &gz).unwrap(), ["s2"]);
    }

    #[test]
    fn two_scans_of_one_name_are_refused() {
        let dir = tree(&["a/s.nii", "b/S.nii.gz"]);
        let words = find_names(
            &[dir.path().join("a"), dir.path().join("b")],
            &Selection::default(),
        );
        assert!(
            words
                .unwrap_err()
                .to_string()
                .contains("two scans are named")
        );
    }

    #[test]
    fn a_scan_cannot_take_the_place_of_the_runs_own_files() {
        let dir = tree(&["report.nii", "a.nii"]);
        let root = dir.path().to_path_buf();
        let words = find_names(&[root], &Selection::default()).unwrap_err();
        assert!(words.to_string().contains("cannot be named `report`"));
        let manifest = dir.path().join("cohort.csv");
        std::fs::write(&manifest, "path,name\na.nii,../../home\n").unwrap();
        let words = find_names(&[manifest], &Selection::default()).unwrap_err();
        assert!(words.to_string().contains("no slashes"), "{words}");
    }

    #[test]
    fn results_are_no_scans_and_a_folder_of_scans_is_not_one() {
        let dir = tree(&[
            "a.nii",
            "b.nii",
            "a/segment.json",
            "a/mask.nii.gz",
            "report/report.html",
            "report/one.png",
            "results.csv",
        ]);
        let root = dir.path().to_path_buf();
        let deep = Selection {
            recursive: true,
            ..Selection::default()
        };
        for selection in [Selection::default(), deep] {
            let names = find_names(std::slice::from_ref(&root), &selection);
            assert_eq!(names.unwrap(), ["a", "b"]);
        }
        for results in ["a", "report"] {
            let words = find_names(&[root.join(results)], &Selection::default());
            let words = words.unwrap_err().to_string();
            assert!(words.contains("folder of results"), "{words}");
        }
        let scans = tree(&["a.nii", "b.nii"]);
        let words = refuse_many(scans.path()).unwrap_err().to_string();
        assert!(words.contains("holds 2 scans"), "{words}");
        assert!(refuse_many(&scans.path().join("a.nii")).is_ok());
    }

    #[test]
    fn pictures_of_different_sizes_are_no_scan() {
        let dir = tree(&["a.nii"]);
        let figures = dir.path().join("figures");
        std::fs::create_dir(&figures).unwrap();
        for (name, width) in [("1.png", 4), ("2.png", 5)] {
            image::GrayImage::new(width, 4)
                .save(figures.join(name))
                .unwrap();
        }
        let root = dir.path().to_path_buf();
        let found = |root: &PathBuf| find_names(std::slice::from_ref(root), &Selection::default());
        assert_eq!(found(&root).unwrap(), ["a"]);
        image::GrayImage::new(4, 4)
            .save(figures.join("2.png"))
            .unwrap();
        assert_eq!(found(&root).unwrap(), ["a", "figures"]);
    }

    #[test]
    fn a_folder_without_scans_is_said() {
        let dir = tree(&["notes.txt"]);
        let words = find_names(&[dir.path().to_path_buf()], &Selection::default());
        assert!(words.unwrap_err().to_string().contains("holds no scans"));
    }
}
