//! Owns notes on results: several in one cell, and which of them say the same of different scans.

use serde::Serialize;

/// What divides the notes of one cell.
const BETWEEN: &str = "; ";

/// In the note of a model that carries no load although the bone does.
pub const NO_ANSWER: &str = "its E_app of 0 says nothing of the bone";

/// Adds a note to a cell, once.
pub fn add(cell: &mut Option<String>, note: &str) {
    match cell {
        Some(all) if all.contains(note) => {}
        Some(all) => *all = format!("{all}{BETWEEN}{note}"),
        None => *cell = Some(note.to_owned()),
    }
}

/// The notes of a cell.
pub fn parts(cell: Option<&str>) -> impl Iterator<Item = &str> {
    let notes = cell.unwrap_or_default().split(BETWEEN);
    notes.filter(|note| !note.is_empty())
}

/// A note without its numbers: notes that differ in numbers only say the same.
pub fn without_numbers(note: &str) -> String {
    let mut text = String::new();
    for c in note.chars() {
        match c {
            '0'..='9' if text.ends_with('#') => {}
            '0'..='9' => text.push('#'),
            other => text.push(other),
        }
    }
    for between in ["#, #", "#.#", "#-#", "#e#", "#e-#"] {
        while text.contains(between) {
            text = text.replace(between, "#");
        }
    }
    text
}

/// A note as the first scan has it, and all scans that it is of.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alike {
    pub first: String,
    pub scans: Vec<String>,
}

/// Notes by what they say, in the order of their first scans.
#[derive(Debug, Clone, Default)]
pub struct Alikes {
    groups: Vec<(String, Alike)>,
}

impl Alikes {
    /// True for the first note of its kind.
    pub fn add(&mut self, note: &str, scan: &str) -> bool {
        let pattern = without_numbers(note);
        match self.groups.iter_mut().find(|(p, _)| *p == pattern) {
            Some((_, group)) => {
                if !group.scans.iter().any(|s| s == scan) {
                    group.scans.push(scan.to_owned());
                }
                false
            }
            None => {
                let group = Alike {
                    first: note.to_owned(),
                    scans: vec![scan.to_owned()],
                };
                self.groups.push((pattern, group));
                true
            }
        }
    }

    pub fn groups(&self) -> impl Iterator<Item = &Alike> {
        self.groups.iter().map(|(_, group)| group)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_that_differ_in_numbers_only_are_alike() {
        let of = |lp: &str, t: &str| format!("lattice parameters {lp} mm exceed half of {t} mm");
        let mut notes = Alikes::default();
        assert!(notes.add(&of("0.1, 0.12", "0.168"), "a"));
        assert!(!notes.add(&of("0.12", "0.2"), "b"));
        assert!(!notes.add(&of("0.12", "0.2"), "b"));
        assert!(notes.add("another matter", "b"));
        let found: Vec<&Alike> = notes.groups().collect();
        assert_eq!(found[0].scans, ["a", "b"]);
        assert_eq!(found[0].first, of("0.1, 0.12", "0.168"));
        assert_eq!(found.len(), 2);
    }

    #[test]
    fn a_note_stands_once_in_a_cell() {
        let mut cell = None;
        for note in ["one", "two", "one"] {
            add(&mut cell, note);
        }
        assert_eq!(cell.as_deref(), Some("one; two"));
    }
}
