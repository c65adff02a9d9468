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
    /// The note of the first scan.
    pub first: String,
    /// Names of all scans that it is of.
    pub scans: Vec<String>,
    /// The notes that differ from the first.
    others: Vec<String>,
}

impl Alike {
    /// The note with the range of each of its numbers over all scans; as the first scan has it, and whose numbers these are,
    /// where the notes have unlike many numbers.
    pub fn of_all(&self) -> String {
        let all: Vec<Vec<Part>> = [&self.first]
            .into_iter()
            .chain(&self.others)
            .map(|note| in_parts(note))
            .collect();
        let [first, others @ ..] = &all[..] else {
            return self.first.clone();
        };
        let alike = |other: &Vec<Part>| {
            other.len() == first.len() && first.iter().zip(other).all(|(a, b)| a.may_be_merged(b))
        };
        if !others.iter().all(alike) {
            return format!(
                "{} (numbers of {}, others differ)",
                self.first, self.scans[0]
            );
        }
        (0..first.len()).map(|at| range(&all, at)).collect()
    }
}

/// A piece of a note.
#[derive(Debug, Clone, Copy)]
enum Part<'a> {
    Text(&'a str),
    Number(&'a str, f64),
}

impl Part<'_> {
    /// Two numbers, or one text.
    fn may_be_merged(&self, other: &Part) -> bool {
        match (self, other) {
            (Part::Number(..), Part::Number(..)) => true,
            (Part::Text(a), Part::Text(b)) => a == b,
            _ => false,
        }
    }
}

/// A note as words and what is between them; a word that is a number, with a point, comma or bracket at its ends, is one.
fn in_parts(note: &str) -> Vec<Part<'_>> {
    let mut parts = Vec::new();
    for word in note.split_inclusive(' ') {
        let digits = word.trim_matches(|c: char| !c.is_ascii_digit());
        let at = word.find(digits).unwrap_or(0);
        let (before, after) = (&word[..at], &word[at + digits.len()..]);
        let is_name = [before, after]
            .iter()
            .any(|part| part.contains(|c: char| c.is_alphabetic() || c == '/'));
        match digits.parse().ok().filter(|_| !is_name) {
            Some(value) => parts.extend([
                Part::Text(before),
                Part::Number(digits, value),
                Part::Text(after),
            ]),
            None => parts.push(Part::Text(word)),
        }
    }
    parts
}

/// The part at a place of all notes: its text, or the range of its numbers.
fn range(notes: &[Vec<Part>], at: usize) -> String {
    let mut numbers: Vec<(&str, f64)> = Vec::new();
    for note in notes {
        match note[at] {
            Part::Text(text) => return text.to_owned(),
            Part::Number(word, value) => numbers.push((word, value)),
        }
    }
    numbers.sort_by(|a, b| a.1.total_cmp(&b.1));
    match &numbers[..] {
        [low, .., high] if low.1 < high.1 => format!("{} to {}", low.0, high.0),
        [one, ..] => one.0.to_owned(),
        [] => String::new(),
    }
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
                if group.first != note && !group.others.iter().any(|other| other == note) {
                    group.others.push(note.to_owned());
                }
                false
            }
            None => {
                let group = Alike {
                    first: note.to_owned(),
                    scans: vec![scan.to_owned()],
                    others: Vec::new(),
                };
                self.groups.push((pattern, group));
                true
            }
        }
    }

    /// The notes so far, in the order of their first scans.
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
    fn alike_notes_have_the_range_of_their_numbers() {
        let mut notes = Alikes::default();
        for (scan, voxels, share) in [("a", 2462, "12"), ("b", 9866, "54.5"), ("c", 30, "0.5")] {
            notes.add(&format!("{voxels} voxels were removed, {share} %."), scan);
        }
        let found: Vec<String> = notes.groups().map(Alike::of_all).collect();
        assert_eq!(found, ["30 to 9866 voxels were removed, 0.5 to 54.5 %."]);
        let mut lists = Alikes::default();
        lists.add("parameters 0.1, 0.12 mm", "a");
        lists.add("parameters 0.12 mm", "b");
        let found: Vec<String> = lists.groups().map(Alike::of_all).collect();
        assert_eq!(
            found,
            ["parameters 0.1, 0.12 mm (numbers of a, others differ)"]
        );
        let mut names = Alikes::default();
        names.add("kept in c1/results.old.csv", "c1");
        names.add("kept in c2/results.old.csv", "c2");
        let found: Vec<String> = names.groups().map(Alike::of_all).collect();
        assert_eq!(
            found,
            ["kept in c1/results.old.csv (numbers of c1, others differ)"]
        );
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
