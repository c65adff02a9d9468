//! Owns the note on rows that do not come to the stated error asked for.

use crate::result::ffb::settings_of;
use crate::result::row::Row;

/// How the note begins.
const MISSED: &str = "the error asked for, ";

/// What is to be said, and of which solve.
pub struct Missed {
    nearest: Row,
    words: String,
}

impl Missed {
    /// `nearest` is the row that comes nearest to what was asked for; `words` go on from "the error asked for, ".
    pub fn of(nearest: Option<&Row>, words: String) -> Missed {
        Missed {
            nearest: nearest.cloned().unwrap_or_default(),
            words: format!("{MISSED}{words}"),
        }
    }

    /// Adds to the note of the row, if it is that solve, or the limit that takes it for its finest.
    pub fn note(&self, row: &mut Row) {
        let noted = row
            .note
            .as_ref()
            .is_some_and(|note| note.contains(&self.words));
        if noted || !is_same_solve(row, &self.nearest) {
            return;
        }
        row.note = Some(match row.note.take() {
            Some(note) => format!("{note}; {}", self.words),
            None => self.words.clone(),
        });
    }

    /// Takes such a note off the row.
    pub fn take_back(row: &mut Row) {
        let Some(note) = row.note.take() else {
            return;
        };
        let parts = note.split("; ").filter(|part| !part.starts_with(MISSED));
        let kept: Vec<&str> = parts.collect();
        row.note = (!kept.is_empty()).then(|| kept.join("; "));
    }
}

fn is_same_solve(a: &Row, b: &Row) -> bool {
    let settings = |row: &Row| Row {
        group: None,
        subject: None,
        registration: None,
        ..settings_of(row)
    };
    let boundary = |row: &Row| {
        matches!(
            row.boundary.as_deref(),
            None | Some("graded" | "extrapolated")
        )
    };
    boundary(a) && boundary(b) && settings(a) == settings(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(boundary: Option<&str>, lp_mm: f64, note: Option<&str>) -> Row {
        Row {
            boundary: boundary.map(str::to_owned),
            lp_mm,
            note: note.map(str::to_owned),
            ..Row::default()
        }
    }

    #[test]
    fn a_limit_and_its_finest_solve_say_what_was_missed() {
        let limit = row(Some("extrapolated"), 0.02, Some("limit of two"));
        let missed = Missed::of(Some(&limit), "3 %, is not met".to_owned());
        let noted = |mut row: Row| {
            missed.note(&mut row);
            missed.note(&mut row);
            row.note
        };
        let words = "the error asked for, 3 %, is not met";
        assert_eq!(noted(row(None, 0.02, None)).as_deref(), Some(words));
        assert_eq!(noted(limit.clone()), Some(format!("limit of two; {words}")));
        assert_eq!(noted(row(None, 0.04, None)), None);
        assert_eq!(noted(row(Some("firm"), 0.02, None)), None);
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
