//! What the section says follows each setting: every row of the table below changes one and names the words that follow.

use bonepd_ct::discretisation::lattice::stencil::Structure;
use bonepd_ct::grid::Axis;
use bonepd_ct::measure::pistoia::Pistoia;
use bonepd_ct::report::methods::{Criterion, Known, Segmented, Threshold, methods};
use bonepd_ct::report::{ReportParams, answers, report};
use bonepd_ct::result::answer::ScanFacts;
use bonepd_ct::result::condition::Condition;
use bonepd_ct::result::row::{FailureLoad, Row, Solution};
use bonepd_ct::result::settings::load_steps::LoadSteps;
use bonepd_ct::result::settings::{
    BoundaryRule, CellType, Conditions, Elements, Ends, Load, Method, Sed, Settings, Supports,
};

/// Voxel FE of one scan, with all that is usual.
fn row() -> Row {
    Row {
        key: Settings {
            scan: "a".to_owned(),
            method: Method::VoxelFe,
            structure: CellType::Hex8,
            elements: Some(Elements::Voxels),
            lp_mm: 0.0195,
            young_mpa: 8748.0,
            poisson: 0.3,
            strain: -0.01,
            tolerance: Some(1e-3),
            sed: Some(Sed::Centre),
            ..Settings::default()
        },
        solved: Some(Solution {
            e_app_mpa: Some(200.0),
            algebraic_error_mpa: Some(0.0),
            discretization_error_mpa: Some(10.0),
            shape_error_mpa: Some(14.0),
            threshold_sensitivity: Some(1.5),
            converged: Some(true),
            ..Solution::default()
        }),
        ..Row::default()
    }
}

fn known() -> Known {
    Known {
        version: "9.8.7".to_owned(),
        segmented: vec![segmented("a")],
        ..Known::default()
    }
}

fn segmented(scan: &str) -> Segmented {
    Segmented {
        scan: scan.to_owned(),
        voxel_mm: [0.0195; 3],
        gaussian_voxels: 0.8,
        threshold: Threshold::Window {
            lower: Some(210.0),
            upper: Some(5600.0),
        },
        unit: Some("HU".to_owned()),
        tv_definition: "box".to_owned(),
        removed_share: 0.0123,
        ..Segmented::default()
    }
}

fn section(rows: &[Row], known: &Known) -> String {
    let answers = answers::answers(rows, |_| {
        let mut facts = ScanFacts::default();
        if let Some(target) = known.target {
            let conditions = rows.iter().map(|row| Condition::of(&row.key));
            conditions.for_each(|condition| facts.targets.set(&condition, target));
        }
        facts
    });
    let report = report(rows, answers, &[], &ReportParams::default());
    methods(&report, known).markdown()
}

#[test]
fn the_usual_case_has_all_its_numbers() {
    let text = section(&[row()], &known());
    for words in [
        "1 scan was analysed with bonepd-ct 9.8.7.",
        "The voxel size was 0.0195 mm.",
        "Gaussian filter (σ = 0.8 voxels)",
        "values from 210 to 5600 HU were bone",
        "the whole box of the scan",
        "Only the largest 6-connected component of bone was kept. This removed 1.23 % of the bone voxels.",
        "Each bone voxel became one eight-node hexahedral element. The edge of an element was 0.0195 mm. Elements were fully integrated.",
        "Young's modulus of 8748 MPa and a Poisson's ratio of 0.3 everywhere",
        "compressed along z by 1 % of the free length: the end planes moved along the axis and were free to slide sideways without friction; the sides were free.",
        "algebraic error of E_app was below 0.1 % (Meurant and Tichý 2019)",
        "The stated error of E_app was 12.0 %;",
        "E_app changes by 1.50 % per 1 % of bone volume.",
        "The bonepd-ct maintainers: bonepd-ct 9.8.7.",
        "Meurant, G.",
        "The source of the tissue modulus of 8748 MPa.",
    ] {
        assert!(text.contains(words), "{words}\n{text}");
    }
    for words in [
        "Otsu",
        "Zojaji",
        "Pistoia",
        "Pahr",
        "Statistics",
        "NaN",
        "further",
    ] {
        assert!(!text.contains(words), "{words}\n{text}");
    }
}

/// A change of a row, the words that follow it, and words that are gone.
type RowCase = (
    fn(&mut Row),
    &'static [&'static str],
    &'static [&'static str],
);

const ROWS: &[RowCase] = &[
    (
        |r| r.key.young_mpa = 1000.0,
        &["modulus of 1000 MPa and", "is the program's default"],
        &["8748"],
    ),
    (
        |r| r.key.poisson = 0.45,
        &["ratio of 0.45", "a blend of"],
        &["fully integrated"],
    ),
    (
        |r| r.key.poisson = 0.495,
        &["averaged over each element"],
        &["fully integrated"],
    ),
    (
        |r| r.key.strain = 0.005,
        &["stretched along z by 0.5 %"],
        &["compressed"],
    ),
    (
        |r| r.key.axis = Axis::X,
        &["compressed along x"],
        &["along z"],
    ),
    (
        |r| r.key.supports = Supports::Ends(Ends::Bonded),
        &["were held sideways (bonded)"],
        &["free to slide"],
    ),
    (
        |r| r.key.grip_mm = 0.6,
        &["the outer 0.6 mm at each end moved as one"],
        &["end planes"],
    ),
    (
        |r| r.key.load = Load::Confined,
        &["(confined)"],
        &["the sides were free"],
    ),
    (
        |r| r.key.tolerance = Some(1e-6),
        &["below 0.0001 %"],
        &["below 0.1 %"],
    ),
    (
        |r| r.key.lp_mm = 0.03900000087,
        &["element was 0.039 mm"],
        &["0.0390000"],
    ),
    (
        |r| r.key.elements = Some(Elements::InterpolatedGrey),
        &["interpolated on a grid finer"],
        &["Each bone voxel"],
    ),
    (
        |r| r.key.elements = Some(Elements::SplitVoxels),
        &["was split into equal"],
        &["became one"],
    ),
    (
        |r| r.key.elements = Some(Elements::BlockMeans),
        &["averaged and thresholded"],
        &["Each bone voxel"],
    ),
    (
        |r| r.key.elements = Some(Elements::BoneFractions),
        &["times its bone fraction"],
        &["Each bone voxel"],
    ),
    (
        |r| r.key.material = Some("power:6850;1.49".to_owned()),
        &[
            "followed the law E = 6850 ρ^1.49, where ρ is",
            "The source of the law",
        ],
        &["8748 MPa", "everywhere"],
    ),
    (
        |r| {
            r.key.plasticity = Some("von-mises:68".to_owned());
            r.key.steps = Some(LoadSteps::Even(12));
            r.solved.as_mut().unwrap().strength.yield_stress_mpa = Some(3.0);
        },
        &[
            "elastic up to yield",
            "law von-mises:68",
            "in 12 even steps",
            "Newton",
            "0.2 % strain",
        ],
        &["linear elastic"],
    ),
    (
        |r| {
            r.key.plasticity = Some("von-mises:68".to_owned());
            r.key.steps = Some(LoadSteps::Adaptive(2));
            r.solved.as_mut().unwrap().strength.yield_stress_mpa = Some(3.0);
        },
        &[
            "elastic up to yield",
            "law von-mises:68",
            "in steps whose length followed the stress–strain curve, divided by 2",
            "Newton",
            "0.2 % strain",
        ],
        &["linear elastic"],
    ),
    (
        |r| {
            r.key.load = Load::Stiffness;
            r.key.supports = Supports::Faces(Conditions::Mixed);
        },
        &["six unit strains", "mixed uniform", "Pahr, D. H."],
        &["kinematic", "compressed"],
    ),
    (
        |r| {
            r.key.load = Load::Stiffness;
            r.key.supports = Supports::Faces(Conditions::Kinematic);
        },
        &["kinematic uniform"],
        &["Pahr", "mixed"],
    ),
    (
        |r| {
            r.key.load = Load::Stiffness;
            r.key.supports = Supports::Faces(Conditions::Symshear);
        },
        &["symmetric shear of four faces"],
        &["kinematic", "mixed"],
    ),
    (
        |r| {
            let solved = r.solved.as_mut().unwrap();
            (r.key.load, r.key.strain) = (Load::ShearY, 0.02);
            (solved.e_app_mpa, solved.force_n) = (None, Some(7.0));
        },
        &[
            "sheared: the upper end moved along y by 2 % of the height along z; both end planes were held in all",
            "error of the stored energy",
        ],
        &["E_app"],
    ),
    (
        |r| {
            let solved = r.solved.as_mut().unwrap();
            (r.key.load, r.key.angle_deg, r.key.grip_mm) = (Load::BendingX, Some(3.0), 0.5);
            (solved.e_app_mpa, solved.moment_nmm) = (None, Some(7.0));
        },
        &[
            "bent about x: both ends across z tilted by 1.5°",
            "the outer 0.5 mm at both ends",
        ],
        &["E_app", "sheared"],
    ),
    (
        |r| {
            let solved = r.solved.as_mut().unwrap();
            (r.key.load, r.key.angle_deg) = (Load::Torsion, Some(2.5));
            (solved.e_app_mpa, solved.moment_nmm) = (None, Some(7.0));
        },
        &["twisted: the upper end turned by 2.5° about z"],
        &["E_app", "bent"],
    ),
    (
        |r| r.solved.as_mut().unwrap().discretization_error_mpa = None,
        &["No discretisation error is stated."],
        &["The stated error of E_app was"],
    ),
    (
        |r| r.solved.as_mut().unwrap().converged = Some(false),
        &["1 answer did not converge."],
        &[],
    ),
    (
        |r| r.solved.as_mut().unwrap().e_app_mpa = Some(0.0),
        &["In 1 scan no bone joined the loaded ends"],
        &["The stated error"],
    ),
    (
        |r| {
            r.key.method = Method::GeometryFe;
            (r.key.structure, r.key.elements) = (CellType::Tet10, Some(Elements::SmoothGrey));
        },
        &[
            "interpolated grey values cross the threshold",
            "ten-node tetrahedral",
            "were made in was 0.0195 mm",
        ],
        &["hexahedral"],
    ),
    (
        |r| {
            r.key.method = Method::GeometryFe;
            (r.key.structure, r.key.elements) = (CellType::Tet10, Some(Elements::SmoothMask));
        },
        &["that of the smoothed mask"],
        &["hexahedral", "grey values cross"],
    ),
    (
        |r| lattice(r, Structure::Sc, BoundaryRule::Floppy),
        &["simple cubic", "parameter of 0.06 mm", "(floppy boundary,"],
        &["hexahedral", "(firm", "(FFB"],
    ),
    (
        |r| lattice(r, Structure::Bcc, BoundaryRule::Firm),
        &["body-centred", "(firm boundary,", "Zojaji, M."],
        &["(floppy", "(FFB"],
    ),
    (
        |r| lattice(r, Structure::Fcc, BoundaryRule::Ffb),
        &["face-centred", "(FFB, Zojaji"],
        &["(connected"],
    ),
    (
        |r| lattice(r, Structure::Sc, BoundaryRule::Graded),
        &["(connected boundary)", "Chen, H."],
        &["weighted", "Zojaji"],
    ),
    (
        |r| lattice(r, Structure::Bcc, BoundaryRule::Graded),
        &["(weighted boundary)"],
        &["(connected", "Zojaji"],
    ),
];

fn lattice(row: &mut Row, structure: Structure, boundary: BoundaryRule) {
    row.key.method = Method::Lattice;
    row.key.structure = CellType::Lattice(structure);
    row.key.boundary = Some(boundary);
    row.key.elements = None;
    row.key.sed = None;
    row.key.lp_mm = 0.06;
}

#[test]
fn each_setting_of_a_solve_is_said() {
    for (i, (change, said, gone)) in ROWS.iter().enumerate() {
        let mut changed = row();
        change(&mut changed);
        let text = section(&[changed], &known());
        for words in *said {
            assert!(text.contains(words), "case {i}: no `{words}` in\n{text}");
        }
        for words in *gone {
            assert!(!text.contains(words), "case {i}: `{words}` in\n{text}");
        }
    }
}

/// A change of a segmentation, the words that follow it, and words that are gone.
type ScanCase = (
    fn(&mut Segmented),
    &'static [&'static str],
    &'static [&'static str],
);

const SCANS: &[ScanCase] = &[
    (
        |s| s.voxel_mm = [0.02, 0.02, 0.05],
        &["0.02 × 0.02 × 0.05 mm"],
        &["0.0195 mm. Grey"],
    ),
    (
        |s| s.gaussian_voxels = 0.0,
        &["were not filtered"],
        &["Gaussian"],
    ),
    (|s| s.gaussian_voxels = 1.0, &["(σ = 1 voxel)"], &["0.8"]),
    (
        |s| s.threshold = Threshold::Otsu { at: Some(107.254) },
        &["Otsu's threshold (Otsu 1979), 107.3 HU", "Otsu, N."],
        &["210"],
    ),
    (
        |s| s.threshold = Threshold::Labels(vec![100, 127]),
        &["had labelled 100 and 127"],
        &["Gaussian", "HU"],
    ),
    (
        |s| {
            s.threshold = Threshold::Window {
                lower: Some(3.0),
                upper: None,
            }
        },
        &["values of 3 HU or more"],
        &["5600"],
    ),
    (
        |s| {
            s.threshold = Threshold::Window {
                lower: None,
                upper: Some(3.0),
            }
        },
        &["values of 3 HU or less"],
        &["5600"],
    ),
    (
        |s| s.unit = None,
        &["to 5600 in the units of the image"],
        &["HU"],
    ),
    (
        |s| s.tv_definition = "cylinder d=4 mm".to_owned(),
        &["interest was: cylinder d=4 mm"],
        &["whole box"],
    ),
    (
        |s| s.plane_cut_mm = Some(1.5),
        &["in every tile of 1.5 mm"],
        &[],
    ),
    (
        |s| s.keep_all = true,
        &["connected or not"],
        &["Only the largest"],
    ),
    (|s| s.removed_share = 0.0, &[], &["This removed"]),
    (
        |s| s.has_morphometry = true,
        &["(Hildebrand and Rüegsegger 1997)", "Hildebrand, T."],
        &[],
    ),
    (
        |s| s.placed = vec!["cropped to x".to_owned(), "turned".to_owned()],
        &["Scans were cropped to x and turned."],
        &[],
    ),
];

#[test]
fn each_setting_of_a_segmentation_is_said() {
    for (i, (change, said, gone)) in SCANS.iter().enumerate() {
        let mut known = known();
        change(&mut known.segmented[0]);
        let text = section(&[row()], &known);
        for words in *said {
            assert!(text.contains(words), "case {i}: no `{words}` in\n{text}");
        }
        for words in *gone {
            assert!(!text.contains(words), "case {i}: `{words}` in\n{text}");
        }
    }
}

#[test]
fn a_cohort_says_where_its_scans_differ() {
    let mut rows: Vec<Row> = ["a", "b", "c", "d"]
        .map(|scan| {
            let mut row = row();
            row.key.scan = scan.to_owned();
            row.marks.subject = Some(scan.replace('d', "c"));
            row.marks.group = Some(if scan < "c" { "control" } else { "OA" }.to_owned());
            row
        })
        .to_vec();
    rows[2].key.lp_mm = 0.025;
    let mut other = rows[0].clone();
    other.key.axis = Axis::Y;
    rows.push(other);
    let mut coarse = rows[0].clone();
    coarse.key.lp_mm = 0.039;
    coarse.solved.as_mut().unwrap().shape_error_mpa = Some(50.0);
    rows.push(coarse);
    rows[1].marks.note = Some("warning: grips of 0.6 mm hold 60 % of the height".to_owned());
    let mut known = known();
    known.failed = 1;
    known.target = Some(0.1);
    known.segmented = ["a", "b", "c"].map(segmented).to_vec();
    known.segmented[1].gaussian_voxels = 0.0;
    known.segmented[2].voxel_mm = [0.025; 3];
    known.segmented[2].threshold = Threshold::Otsu { at: Some(99.0) };
    let text = section(&rows, &known);
    for words in [
        "4 scans of 3 subjects in 2 groups: control (2 scans of 2 subjects) and OA (2 scans of 1 subject), were analysed",
        "1 further scan could not be analysed.",
        "was 0.0195 and 0.025 mm.",
        "(σ = 0.8 voxels) (of a and c). Grey values were not filtered (of b).",
        "5600 HU were bone (of a and b).",
        "99 HU (of c).",
        "Further solves of these scans, under other conditions, are not described here (axis y).",
        "The target of the stated error was 10 %; it was met on 0 of 4.",
        "The segmentation of d: the folder was not found.",
        "This removed at most 1.23 % of a scan's bone voxels (",
        "was 0.0195 mm (of a, b and d). The edge of an element was 0.025 mm (of c).",
        "The same model was also solved with 0.039 mm;",
        "- What this warning means for the study: grips of 0.6 mm hold 60 % of the height (b).",
        "mean ± standard deviation over subjects",
    ] {
        assert!(text.contains(words), "{words}\n{text}");
    }
}

/// One sentence, however many values there are.
#[test]
fn thresholds_of_otsu_are_listed_with_their_scans() {
    let mut known = known();
    known.segmented = ["a", "b", "c", "d"].map(segmented).to_vec();
    for (scan, at) in known.segmented.iter_mut().zip([107.254, 99.0, 99.0]) {
        scan.threshold = Threshold::Otsu { at: Some(at) };
    }
    known.segmented[1].unit = None;
    let text = section(&[row()], &known);
    for words in [
        "Bone was found by Otsu's threshold (Otsu 1979): 107.3 HU (a), 99 in the units of the image (b) and 99 HU (c). Voxels",
        "5600 HU were bone (of d).",
    ] {
        assert!(text.contains(words), "{words}\n{text}");
    }
    // Of one value it needs no list.
    known.segmented.truncate(1);
    let text = section(&[row()], &known);
    assert!(text.contains("(Otsu 1979), 107.3 HU."), "{text}");
}

#[test]
fn the_criterion_of_a_failure_load_is_the_one_in_use() {
    let mut failing = row();
    failing.solved.as_mut().unwrap().failure = Some(FailureLoad {
        factor: 0.5,
        load_n: Some(40.0),
        ..FailureLoad::default()
    });
    let mut known = known();
    let pistoia = Pistoia {
        critical_volume: 0.05,
        critical_strain: 0.0085,
    };
    known.criteria = vec![Criterion {
        pistoia,
        labels: vec![127],
    }];
    let text = section(&[failing.clone()], &known);
    assert!(
        text.contains("5.00 % of the bone of label 127 exceed an effective strain of 0.0085"),
        "{text}"
    );
    assert!(
        text.contains("at the centre of each element") && text.contains("Pistoia, W."),
        "{text}"
    );
    failing.key.sed = Some(Sed::Mean);
    let text = section(&[failing], &known);
    assert!(
        text.contains("from the mean strain energy density"),
        "{text}"
    );
}

#[test]
fn a_limit_names_the_sizes_that_lead_to_it() {
    let of = |boundary, lp_mm| {
        let mut row = row();
        lattice(&mut row, Structure::Sc, boundary);
        row.key.lp_mm = lp_mm;
        if boundary == BoundaryRule::Graded {
            row.solved.as_mut().unwrap().discretization_error_mpa = None;
        }
        row
    };
    let rows = [
        of(BoundaryRule::Graded, 0.12),
        of(BoundaryRule::Graded, 0.1),
        of(BoundaryRule::Graded, 0.08),
        of(BoundaryRule::Firm, 0.2),
        of(BoundaryRule::Extrapolated, 0.08),
    ];
    let text = section(&rows, &known());
    assert!(
        text.contains("parameters of 0.12, 0.1 and 0.08 mm"),
        "{text}"
    );
    assert!(
        text.contains("extrapolated to a lattice parameter of zero"),
        "{text}"
    );
}

#[test]
fn nothing_solved_says_so() {
    assert!(section(&[], &Known::default()).contains("Nothing was solved"));
}
