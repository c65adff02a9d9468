//! Owns what a reader must know of a row whose settings are unusual: grips that hold much of the specimen, coarse lattices,
//! moduli in another unit, large strains.

use crate::result::notes;
use crate::result::row::Row;
use crate::result::settings::{BoundaryRule, Conditions, Supports};

/// How a caution begins in a row's note.
pub const WARNING: &str = "warning: ";

/// Grips that hold more of the height than this change what is measured.
const MOST_GRIPPED: f64 = 0.2;

/// Bone tissue is softer or stiffer than this in no study: GPa or Pa were meant.
const TISSUE_MPA: [f64; 2] = [100.0, 40_000.0];

/// Strains beyond this are outside of what a linear model describes.
const MOST_STRAIN: f64 = 0.1;

/// What to warn of, of a specimen of this height along the load axis. None of it needs the solve.
pub fn cautions(row: &Row, height_mm: f64) -> Vec<String> {
    let found = [
        grips(row, height_mm),
        tissue(row),
        strain(row),
        coarse(row),
        upper_bound(row),
    ];
    found.into_iter().flatten().collect()
}

/// Puts the cautions into the row's note.
pub fn mark(row: &mut Row, height_mm: f64) {
    for caution in cautions(row, height_mm) {
        notes::add(&mut row.marks.note, &format!("{WARNING}{caution}"));
    }
}

fn grips(row: &Row, height_mm: f64) -> Option<String> {
    let grip_mm = row.key.grip_mm;
    let share = 2.0 * grip_mm / height_mm;
    (share > MOST_GRIPPED).then(|| {
        format!(
            "grips of {grip_mm} mm hold {:.0} % of the height of {:.2} mm (free ends slide sideways in them, bonded ends do not): E_app is that of the part between them and can be several times that of the specimen between its end planes (--grip-mm 0)",
            100.0 * share,
            height_mm
        )
    })
}

fn tissue(row: &Row) -> Option<String> {
    let e = row.key.young_mpa;
    let [low, high] = TISSUE_MPA;
    let meant = match e {
        e if e < low => format!("in GPa it would be {} MPa", 1000.0 * e),
        e if e > high => format!("in Pa it would be {} MPa", 1e-6 * e),
        _ => return None,
    };
    Some(format!(
        "a tissue modulus of {e} MPa lies outside 0.1 to 40 GPa, where bone is. Moduli are given in MPa ({meant})"
    ))
}

fn strain(row: &Row) -> Option<String> {
    let strain = row.key.strain;
    let model = match row.key.plasticity {
        None => "the model is linear, and forces and fields grow with it without limit",
        Some(_) => "strains and turns are taken as small, which they are not",
    };
    (strain.abs() > MOST_STRAIN).then(|| {
        format!(
            "a strain of {strain} is {:.0} %: {model} (1 % is -0.01)",
            100.0 * strain.abs()
        )
    })
}

/// Struts thinner than two lattice parameters are one or two sites thick, which connected and weighted lattices make up for.
fn coarse(row: &Row) -> Option<String> {
    let plain = matches!(
        row.key.boundary,
        Some(BoundaryRule::Firm | BoundaryRule::Floppy | BoundaryRule::Ffb)
    );
    let thickness = row.marks.mean_thickness_mm.filter(|_| plain)?;
    (row.key.lp_mm > 0.5 * thickness).then(|| {
        format!(
            "the lattice parameter of {} mm exceeds {:.3} mm, half of the mean strut thickness: E_app is far from converged there",
            row.key.lp_mm,
            0.5 * thickness
        )
    })
}

/// A stiffness under kinematic conditions is no compression test.
fn upper_bound(row: &Row) -> Option<String> {
    (row.key.supports == Supports::Faces(Conditions::Kinematic)).then(|| {
        "E_app follows from the stiffness under kinematic conditions, an upper bound: of a small specimen it can be several times the modulus of a compression test (--conditions mixed is nearer to it)"
            .to_owned()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(change: impl FnOnce(&mut Row)) -> Row {
        let mut row = Row::default();
        row.key.young_mpa = 1000.0;
        row.key.strain = -0.01;
        row.key.lp_mm = 0.1;
        row.key.boundary = Some(BoundaryRule::Floppy);
        row.marks.mean_thickness_mm = Some(0.25);
        change(&mut row);
        row
    }

    #[test]
    fn slips_are_named_and_usual_settings_are_not() {
        assert_eq!(cautions(&row(|_| ()), 5.0), Vec::<String>::new());
        for (row, said) in [
            (row(|r| r.key.grip_mm = 0.6), "24 % of the height"),
            (row(|r| r.key.young_mpa = 10.0), "it would be 10000 MPa"),
            (row(|r| r.key.young_mpa = 17e9), "it would be 17000 MPa"),
            (row(|r| r.key.strain = -0.5), "50 %: the model is linear"),
            (
                row(|r| {
                    r.key.strain = -0.5;
                    r.key.plasticity = Some("von-mises:68".into());
                }),
                "taken as small",
            ),
            (row(|r| r.key.lp_mm = 0.15), "far from converged"),
        ] {
            let found = cautions(&row, 5.0);
            assert!(found.len() == 1 && found[0].contains(said), "{found:?}");
        }
        let graded = row(|r| (r.key.lp_mm, r.key.boundary) = (0.15, Some(BoundaryRule::Graded)));
        assert_eq!(cautions(&graded, 5.0), Vec::<String>::new());
    }

    #[test]
    fn a_caution_stands_once_in_the_note() {
        let mut row = row(|r| r.key.grip_mm = 0.6);
        mark(&mut row, 2.0);
        let once = row.marks.note.clone();
        mark(&mut row, 2.0);
        assert_eq!(row.marks.note, once);
        assert!(
            once.unwrap()
                .starts_with("warning: grips of 0.6 mm hold 60 %")
        );
    }
}
