//! Owns the note on rows whose stated error is above the requested one.

use crate::result::row::Row;
use crate::result::settings::{BoundaryRule, Settings};

/// How the note begins.
const PREFIX: &str = "the error asked for, ";

/// The note, and the solve it is about.
pub struct ErrorTargetNote {
    nearest: Option<Settings>,
    words: String,
}

impl ErrorTargetNote {
    /// `nearest` is the row with the smallest stated error; `words` follow "the error asked for, ".
    pub fn of(nearest: Option<&Row>, words: String) -> ErrorTargetNote {
        ErrorTargetNote {
            nearest: nearest.map(|row| row.key.clone()),
            words: format!("{PREFIX}{words}"),
        }
    }

    /// Adds to the note of the row, if it is that solve, or the limit that takes it for its finest.
    pub fn add_to(&self, row: &mut Row) {
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

    /// Removes such a note from the row.
    pub fn remove_note(row: &mut Row) {
        let Some(note) = row.marks.note.take() else {
            return;
        };
        let parts = note.split("; ").filter(|part| !part.starts_with(PREFIX));
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
            None | Some(BoundaryRule::Graded | BoundaryRule::Extrapolated)
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
        let note = ErrorTargetNote::of(Some(&limit), "3 %, is not met".to_owned());
        let noted = |mut row: Row| {
            note.add_to(&mut row);
            note.add_to(&mut row);
            row.marks.note
        };
        let words = "the error asked for, 3 %, is not met";
        assert_eq!(noted(row(None, 0.02, None)).as_deref(), Some(words));
        assert_eq!(noted(limit.clone()), Some(format!("limit of two; {words}")));
        assert_eq!(noted(row(None, 0.04, None)), None);
        assert_eq!(noted(row(Some(BoundaryRule::Firm), 0.02, None)), None);
    }

    #[test]
    fn the_note_of_an_earlier_target_is_removed() {
        for note in [None, Some("no path")] {
            let before = row(None, 0.02, note);
            let mut after = before.clone();
            ErrorTargetNote::of(Some(&before), "3 %, is not met".to_owned()).add_to(&mut after);
            assert_ne!(after, before);
            ErrorTargetNote::remove_note(&mut after);
            assert_eq!(after, before);
        }
    }
}
