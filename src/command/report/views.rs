//! Owns the views of scans: copied next to the page, which links them.

use super::Folders;
use crate::command::fields::pictures;
use crate::io::own_files::VIEW;
use crate::report::file_name;
use crate::report::html::ScanPage;
use std::collections::HashSet;

/// Gives each page the links to its views; returns the files, name and content.
pub(super) fn linked(pages: &mut [ScanPage], folders: &Folders) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    let mut used = HashSet::new();
    for page in pages {
        let Some(dir) = folders.get(&page.scan).map(|folder| &folder.dir) else {
            continue;
        };
        let bone = ("the bone".to_owned(), VIEW.to_owned());
        let fields = pictures::views(dir).into_iter();
        let fields = fields.map(|(field, file)| (format!("coloured by {field}"), file));
        for (words, file) in std::iter::once(bone).chain(fields) {
            let Ok(content) = std::fs::read(dir.join(&file)) else {
                continue;
            };
            let name = free(
                &format!("{}{}", file_name(&page.scan), part(&file)),
                &mut used,
            );
            page.views.push((words, name.clone()));
            files.push((name, content));
        }
    }
    files
}

/// What a view adds to the name of its scan: nothing, or the field.
fn part(file: &str) -> &str {
    let stem = file.trim_end_matches(".html");
    stem.trim_start_matches("view")
}

/// `view-STEM.html`, numbered where another scan has it.
fn free(stem: &str, used: &mut HashSet<String>) -> String {
    let numbered = (1..).map(|n| match n {
        1 => format!("view-{stem}.html"),
        n => format!("view-{stem}-{n}.html"),
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
        let names = ["a", "A", "a-sed-mpa"].map(|stem| free(stem, &mut used));
        assert_eq!(
            names,
            ["view-a.html", "view-A-2.html", "view-a-sed-mpa.html"]
        );
        assert_eq!(
            ["view.html", "view-sed-mpa.html"].map(part),
            ["", "-sed-mpa"]
        );
    }
}
