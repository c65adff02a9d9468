//! Exported lattices say what they hold: counts in the headers are counts of lines.

use bonepd_ct::export::{inp, lammps, vtk};
use bonepd_ct::grid::Axis;
use bonepd_ct::physics::lattice::{Lattice, Moduli};
use bonepd_ct::physics::material::{Label, Law, Material};
use bonepd_ct::pipeline::apparent::{Method, SolveParams};
use bonepd_ct::pipeline::lattice::{Boundary, Case, Structure, build, build_of};
use bonepd_ct::volume::{Specimen, Volume};

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
    let tissue = lammps::Tissue {
        young_mpa: 1000.0,
        bins: 64,
    };
    lammps::write(&path, &sites, tissue).unwrap();
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
}

/// K, r0 and ends.
type Bond = (f64, f64, [usize; 2]);

/// Bonds and positions of a data file.
fn read_lammps(text: &str) -> (Vec<Bond>, Vec<[f64; 3]>) {
    let table = |title: &str| -> Vec<Vec<f64>> {
        let (_, rest) = text.split_once(&format!("\n{title}\n\n")).unwrap();
        let lines = rest.lines().take_while(|line| !line.is_empty());
        lines
            .map(|line| line.split(' ').map(|w| w.parse().unwrap()).collect())
            .collect()
    };
    let kinds = table("Bond Coeffs # harmonic");
    let bond = |row: &Vec<f64>| {
        let kind = &kinds[row[1] as usize - 1];
        (kind[1], kind[2], [row[2] as usize - 1, row[3] as usize - 1])
    };
    let atoms = table("Atoms # bond");
    (
        table("Bonds").iter().map(bond).collect(),
        atoms.iter().map(|row| [row[3], row[4], row[5]]).collect(),
    )
}

/// What LAMMPS makes of small displacements: `Σ K (elongation)²`.
fn energy(path: &std::path::Path, u: &[[f64; 3]]) -> f64 {
    let (bonds, at) = read_lammps(&std::fs::read_to_string(path).unwrap());
    let stretched = bonds.iter().map(|&(k, length, [i, j])| {
        let along = |c: usize| (at[j][c] - at[i][c]) / length * (u[j][c] - u[i][c]);
        k * (along(0) + along(1) + along(2)).powi(2)
    });
    stretched.sum()
}

#[test]
fn exported_lattices_of_mixed_tissue_store_the_energy_of_the_lattice() {
    let specimen = crate::laws::irregular_specimen();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("mixed.data");
    let voxels = specimen.bone.as_slice().len();
    let tissues: [Vec<f32>; 2] = [
        (0..voxels)
            .map(|i| if i % 3 == 0 { 0.5 } else { 1.25 })
            .collect(),
        (0..voxels).map(|i| 0.4 + (i % 101) as f32 / 80.0).collect(),
    ];
    for boundary in [Boundary::Floppy, Boundary::Weighted] {
        for tissue in &tissues {
            let case = case(boundary);
            let sites = build_of(&specimen, Some(tissue), &case, Axis::Z, 0.0).unwrap();
            let moduli = Moduli::new(case.structure, case.lp_mm, 700.0, 0.25).unwrap();
            let u: Vec<[f64; 3]> = (0..sites.len())
                .map(|s| [1, 2, 3].map(|c| ((s * 7 + c * 13) % 31) as f64 * 1e-4))
                .collect();
            let exact = Lattice::new(sites.clone(), moduli).energy(&u);
            let written = |bins: usize| {
                let tissue = lammps::Tissue {
                    young_mpa: 700.0,
                    bins,
                };
                let worst = lammps::write(&path, &sites, tissue).unwrap();
                (energy(&path, &u) / exact - 1.0, worst)
            };
            let (off, worst) = written(1_000_000);
            assert!(off.abs() < 1e-9 && worst == 0.0, "{off} {worst}");
            let (off, worst) = written(12);
            assert!(
                worst > 0.0 && worst < 0.3 && off.abs() < worst,
                "{off} {worst}"
            );
        }
    }
}

/// Materials of an `.inp` and the numbers of their elements.
fn read_inp(text: &str) -> Vec<(f64, f64, usize)> {
    let parts = text.split("*ELEMENT, TYPE=C3D8, ELSET=BONE").skip(1);
    let material = |part: &str| {
        let elements = part
            .lines()
            .skip(1)
            .take_while(|line| !line.starts_with('*'));
        let (_, elastic) = part.split_once("*ELASTIC\n").unwrap();
        let (young, poisson) = elastic.lines().next().unwrap().split_once(", ").unwrap();
        (
            young.parse().unwrap(),
            poisson.parse().unwrap(),
            elements.count(),
        )
    };
    parts.map(material).collect()
}

#[test]
fn every_element_of_an_inp_has_the_material_of_its_voxel() {
    let n = [6, 5, 8];
    let mut specimen = crate::specimens::specimen(n, [0.02; 3], |_| true);
    let grid = specimen.bone.grid;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("model.inp");
    let params = |law: Law| SolveParams {
        method: Method::VoxelFe,
        material: Some(Material::new(law)),
        ..SolveParams::default()
    };
    let written = |specimen: &Specimen, params: &SolveParams, bins: usize| {
        let worst = inp::write(&path, specimen, params, bins).unwrap();
        (read_inp(&std::fs::read_to_string(&path).unwrap()), worst)
    };
    let label = |value, young_mpa, poisson| Label {
        value,
        young_mpa,
        poisson: Some(poisson),
    };
    let grey = |value: &dyn Fn(usize) -> f32| {
        Some(Volume::from_vec(grid, (0..grid.len()).map(value).collect()))
    };
    specimen.grey = grey(&|i| [100.0, 127.0, 127.0][i % 3]);
    let two = params(Law::Labels(vec![
        label(100, 500.0, 0.2),
        label(127, 2000.0, 0.3),
    ]));
    let (mut found, worst) = written(&specimen, &two, 8);
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert_eq!((found.len(), worst), (2, 0.0));
    for (found, (young, poisson, elements)) in
        found.iter().zip([(500.0, 0.2, 80), (2000.0, 0.3, 160)])
    {
        // Factors of the mean are single precision.
        assert!((found.0 / young - 1.0).abs() < 1e-6, "{found:?}");
        assert_eq!((found.1, found.2), (poisson, elements));
    }
    specimen.grey = grey(&|i| 100.0 + i as f32);
    let law = params(Law::Linear {
        slope: 10.0,
        intercept: 0.0,
    });
    let (found, worst) = written(&specimen, &law, 8);
    assert_eq!(found.len(), 8);
    assert_eq!(found.iter().map(|m| m.2).sum::<usize>(), grid.len());
    let sum: f64 = found.iter().map(|m| m.0 * m.2 as f64).sum();
    let exact: f64 = (0..grid.len()).map(|i| 1000.0 + 10.0 * i as f64).sum();
    assert!((sum / exact - 1.0).abs() < 1e-6, "{sum} {exact}");
    assert!(worst > 0.02 && worst < 0.12, "{worst}");
    let coarse = SolveParams {
        coarsen: 2,
        material: None,
        ..law
    };
    let (found, _) = written(&specimen, &coarse, 8);
    assert_eq!(found.iter().map(|m| m.2).sum::<usize>(), 3 * 3 * 4);
}

#[test]
fn vtk_has_as_many_bytes_as_its_counts_ask_for() {
    let sites = build(
        &crate::laws::irregular_specimen(),
        &case(Boundary::Weighted),
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

/// A network of bonds has a Poisson's ratio of its own: said where it is written.
#[test]
fn lammps_data_are_told_to_be_of_a_quarter() {
    use bonepd_ct::grid::Grid;
    let dir = tempfile::tempdir().unwrap();
    let (scan, out) = (dir.path().join("s.nii"), dir.path().join("out"));
    let grid = Grid::new([8; 3], [0.05; 3]);
    bonepd_ct::image::nifti::write(&scan, &Volume::from_vec(grid, vec![9i16; 512])).unwrap();
    let [scan, out] = [&scan, &out].map(|path| path.to_str().unwrap());
    assert_eq!(
        crate::cli::run(&["segment", scan, "-o", out, "--lower", "1"]).0,
        0
    );
    let said = |format: &str| {
        let words = ["lattice", out, "--lp", "0.1", "--quiet", "--export", format];
        let (code, _, stderr) = crate::cli::run(&words);
        assert_eq!(code, 0, "{stderr}");
        stderr
    };
    let words = said("lammps");
    assert!(
        words.contains("warning: ") && words.contains("solve --poisson 0.25"),
        "{words}"
    );
    assert!(!said("vtk").contains("0.25"));
    // Next to the data, the steps for the whole bar of 0.4 mm: nothing is left to fill in.
    let script =
        std::fs::read_to_string(std::path::Path::new(out).join("lattice-sc-floppy-0.1.in"))
            .unwrap();
    assert!(!script.contains('@'), "{script}");
    for line in [
        "read_data lattice-sc-floppy-0.1.data",
        "variable area equal 0.16",
    ] {
        assert!(script.contains(line), "{line}: {script}");
    }
    assert!(
        script.contains("$(0.4-v_grip_mm-") && script.contains("comm_modify cutoff 0.3"),
        "{script}"
    );
}
