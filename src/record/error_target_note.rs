//! Owns the note on rows that do not come to the stated error asked for.

use crate::result::row::Row;
use crate::result::settings::{BoundaryRule, Settings};

/// How the note begins.
const MISSED: &str = "the error asked for, ";

/// What is to be said, and of which solve.
pub struct Missed {
    nearest: Option<Settings>,
    words: String,
}

impl Missed {
    /// `nearest` is the row that comes nearest to what was asked for; `words` go on from "the error asked for, ".
    pub fn of(nearest: Option<&Row>, words: String) -> Missed {
        Missed {
            nearest: nearest.map(|row| row.key.clone()),
            words: format!("{MISSED}{words}"),
        }
    }

    /// Adds to the note of the row, if it is that solve, or the limit that takes it for its finest.
    pub fn note(&self, row: &mut Row) {
        let note = &mut row.marks.note;
        let noted = note.as_ref().is_some_and(|n| n.contains(&self.words));
        let same = self
            .nearest
            .as_ref()
            .is_some_and(|nearest| is_same_solve(&row.key, nearest));
        if noted || !same {
            return;
        }
        *note = Some(match note.take() {
            Some(note) => format!("{note}; {}", self.words),
            None => self.words.clone(),
        });
    }

    /// Takes such a note off the row.
    pub fn take_back(row: &mut Row) {
        let Some(note) = row.marks.note.take() else {
            return;
        };
        let parts = note.split("; ").filter(|part| !part.starts_with(MISSED));
        let kept: Vec<&str> = parts.collect();
        row.marks.note = (!kept.is_empty()).then(|| kept.join("; "));
    }
}

/// Of a boundary that an error is stated for, wherever the lattice falls.
fn is_same_solve(a: &Settings, b: &Settings) -> bool {
    let settings = |key: &Settings| Settings {
        registration_mm: None,
        ..key.without_boundary()
    };
    let stated = |key: &Settings| {
        matches!(
            key.boundary,
            None | Some(BoundaryRule::GRADED | BoundaryRule::Extrapolated)
        )
    };
    stated(a) && stated(b) && settings(a) == settings(b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::row::Marks;

    fn row(boundary: Option<BoundaryRule>, lp_mm: f64, note: Option<&str>) -> Row {
        Row {
            key: Settings {
                boundary,
                lp_mm,
                ..Settings::default()
            },
            solved: None,
            marks: Marks {
                note: note.map(str::to_owned),
                ..Marks::default()
            },
        }
    }

    #[test]
    fn a_limit_and_its_finest_solve_say_what_was_missed() {
        let limit = row(Some(BoundaryRule::Extrapolated), 0.02, Some("limit of two"));
        let missed = Missed::of(Some(&limit), "3 %, is not met".to_owned());
        let noted = |mut row: Row| {
            missed.note(&mut row);
            missed.note(&mut row);
            row.marks.note
        };
        let words = "the error asked for, 3 %, is not met";
        assert_eq!(noted(row(None, 0.02, None)).as_deref(), Some(words));
        assert_eq!(noted(limit.clone()), Some(format!("limit of two; {words}")));
        assert_eq!(noted(row(None, 0.04, None)), None);
        assert_eq!(noted(row(Some(BoundaryRule::FIRM), 0.02, None)), None);
    }

    #[test]
    fn what_was_said_of_an_earlier_target_is_taken_back() {
        for note in [None, Some("no path")] {
            let before = row(None, 0.02, note);
            let mut after = before.clone();
            Missed::of(Some(&before), "3 %, is not met".to_owned()).note(&mut after);
            assert_ne!(after, before);
            Missed::take_back(&mut after);
            assert_eq!(after, before);
        }
    }
}
