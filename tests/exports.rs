//! Exported lattices say what they hold: counts in the headers are counts of lines.

use bonepd_ct::grid::Axis;
use bonepd_ct::io::{lammps, vtk};
use bonepd_ct::stage::lattice::{Boundary, Case, Structure, build};

fn case(boundary: Boundary) -> Case {
    Case {
        structure: Structure::Bcc,
        lp_mm: 0.05,
        boundary,
        registration_mm: [0.0; 3],
    }
}

#[test]
fn lammps_data_has_the_atoms_and_bonds_it_announces() {
    let specimen = crate::laws::irregular_specimen();
    let sites = build(&specimen, &case(Boundary::Floppy), Axis::Z, 0.0).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("lattice.data");
    lammps::write(&path, &sites).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let (head, bonds) = text.split_once("\nBonds\n\n").unwrap();
    let (_, atoms) = head.split_once("\nAtoms # bond\n\n").unwrap();
    let atoms: Vec<Vec<&str>> = atoms.lines().map(|l| l.split(' ').collect()).collect();
    assert!(text.contains(&format!(
        "\n{} atoms\n{} bonds\n",
        sites.len(),
        sites.bonds()
    )));
    assert_eq!(atoms.len(), sites.len());
    assert_eq!(bonds.lines().count(), sites.bonds());
    // Every bond is as long as its type says.
    let at = |id: &str| -> Vec<f64> {
        let atom = &atoms[id.parse::<usize>().unwrap() - 1];
        atom[3..].iter().map(|v| v.parse().unwrap()).collect()
    };
    for bond in bonds.lines() {
        let words: Vec<&str> = bond.split(' ').collect();
        let squared: f64 = at(words[2])
            .iter()
            .zip(at(words[3]))
            .map(|(a, b)| (a - b).powi(2))
            .sum();
        let length = if words[1] == "1" {
            0.05 * 0.75f64.sqrt()
        } else {
            0.05
        };
        assert!((squared.sqrt() - length).abs() < 1e-12, "{bond}");
    }
    assert!(
        lammps::write(
            &path,
            &build(&specimen, &case(Boundary::Graded), Axis::Z, 0.0).unwrap()
        )
        .is_err()
    );
}

#[test]
fn vtk_has_as_many_bytes_as_its_counts_ask_for() {
    let sites = build(
        &crate::laws::irregular_specimen(),
        &case(Boundary::Graded),
        Axis::Z,
        0.0,
    )
    .unwrap();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("lattice.vtk");
    vtk::write_lattice(&path, &sites).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let find = |word: &str| {
        bytes
            .windows(word.len())
            .position(|w| w == word.as_bytes())
            .unwrap()
    };
    let points = find(" float\n") + 7;
    let lines = find(&format!(
        "\nLINES {} {}\n",
        sites.bonds(),
        3 * sites.bonds()
    ));
    assert_eq!(lines - points, 12 * sites.len());
    let data = find(&format!("\nPOINT_DATA {}\n", sites.len()));
    let header = format!("\nLINES {} {}\n", sites.bonds(), 3 * sites.bonds()).len();
    assert_eq!(data - lines - header, 12 * sites.bonds());
}
