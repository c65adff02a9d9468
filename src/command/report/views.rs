//! Owns the views of scans: copied next to the page, which links them.

use super::Folders;
use crate::command::fields::pictures;
use crate::io::own_files::{SITES, VIEW};
use crate::report::file_name;
use crate::report::html::ScanPage;
use std::collections::HashSet;

/// Gives each page the links to its views and to the picture of its sites, which is too large for the page; returns the files, name and
/// content.
pub(super) fn linked(pages: &mut [ScanPage], folders: &Folders) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    let mut used = HashSet::new();
    for page in pages {
        let Some(dir) = folders.get(&page.scan).map(|folder| &folder.dir) else {
            continue;
        };
        let bone = (
            "the bone, to turn under the mouse".to_owned(),
            VIEW.to_owned(),
        );
        let fields = pictures::views(dir).into_iter();
        let fields = fields.map(|(field, file)| (format!("the same, coloured by {field}"), file));
        let sites = (
            "sites of the lattices over the bone".to_owned(),
            SITES.to_owned(),
        );
        for (words, file) in [bone].into_iter().chain(fields).chain([sites]) {
            let Ok(content) = std::fs::read(dir.join(&file)) else {
                continue;
            };
            let name = free(&file, &file_name(&page.scan), &mut used);
            page.views.push((words, name.clone()));
            files.push((name, content));
        }
    }
    files
}

/// `view-SCAN.html` for `view.html`, `view-SCAN-sed-mpa.html` for `view-sed-mpa.html`, `sites-SCAN.png` for `sites.png`; numbered where another
/// scan has that name.
fn free(file: &str, scan: &str, used: &mut HashSet<String>) -> String {
    let (stem, extension) = file.split_once('.').unwrap_or((file, ""));
    let (kind, part) = stem.split_once('-').unwrap_or((stem, ""));
    let part = match part {
        "" => String::new(),
        part => format!("-{part}"),
    };
    let numbered = (1..).map(|n| match n {
        1 => format!("{kind}-{scan}{part}.{extension}"),
        n => format!("{kind}-{scan}{part}-{n}.{extension}"),
    });
    let mut free = numbered.filter(|name| used.insert(name.to_lowercase()));
    free.next().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_of_like_names_are_files_of_their_own() {
        let mut used = HashSet::new();
        let mut name = |file, scan| free(file, scan, &mut used);
        assert_eq!(name("view.html", "a"), "view-a.html");
        assert_eq!(name("view.html", "A"), "view-A-2.html");
        assert_eq!(name("view-sed-mpa.html", "a"), "view-a-sed-mpa.html");
        assert_eq!(name("sites.png", "a"), "sites-a.png");
    }
}
