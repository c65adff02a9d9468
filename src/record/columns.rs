//! Owns the data dictionary: what each column of the result files means, and its unit.

use serde::Serialize;

#[derive(Debug, Serialize)]
pub struct Column {
    pub name: &'static str,
    /// Empty for words and counts.
    pub unit: &'static str,
    pub about: &'static str,
}

#[derive(Debug, Serialize)]
pub struct File {
    pub name: &'static str,
    pub about: &'static str,
    pub columns: &'static [Column],
}

const fn column(name: &'static str, unit: &'static str, about: &'static str) -> Column {
    Column { name, unit, about }
}

/// All files, in the order in which readers meet them.
pub const FILES: [File; 4] = [
    File {
        name: "answers.csv",
        about: "one row a scan: its apparent modulus with all of its stated error, by the row of the least stated error",
        columns: &ANSWERS,
    },
    File {
        name: "results.csv",
        about: "one row a solve, and rows that follow from several solves (boundary ffb, extrapolated)",
        columns: &RESULTS,
    },
    File {
        name: "failed.csv",
        about: "scans of a run that have no results",
        columns: &FAILED,
    },
    File {
        name: "history.csv",
        about: "numbers of a two-dimensional scene over time; its other columns are listed in pipelines/README.md",
        columns: &HISTORY,
    },
];

const SCAN: Column = column(
    "scan",
    "",
    "name of the scan: of its file, its folder, or in the manifest",
);
const BV_TV: Column = column("bv_tv", "", "bone volume fraction, 0 to 1");
const YOUNG: Column = column(
    "young_mpa",
    "MPa",
    "Young's modulus of the bone tissue; with `material` the bone's mean",
);
const POISSON: Column = column("poisson", "", "Poisson's ratio of the bone tissue");
const LOAD: Column = column(
    "load",
    "",
    "uniaxial (sides free), confined (sides held), stiffness (six unit strains)",
);
const ENDS: Column = column(
    "ends",
    "",
    "free: loaded ends slide sideways; bonded: they do not; of load stiffness: kinematic or mixed faces",
);
const AXIS: Column = column("axis", "", "axis along which the specimen is compressed");
const GRIP: Column = column(
    "grip_mm",
    "mm",
    "thickness that moves as a rigid plate at each end; 0: end planes only",
);
const GROUP: Column = column("group", "", "from the manifest");
const SUBJECT: Column = column("subject", "", "from the manifest: who the scan is of");
const FAILURE_LOAD: Column = column(
    "failure_load_n",
    "N",
    "force at failure by Pistoia's criterion, a magnitude; where --failure asks for it",
);

const ANSWERS: [Column; 22] = [
    SCAN,
    SUBJECT,
    GROUP,
    BV_TV,
    column(
        "e_app_mpa",
        "MPa",
        "apparent modulus K L / A, pores included in A",
    ),
    column(
        "error_mpa",
        "MPa",
        "everything that is stated: algebraic, discretisation and shape error together; NA where the method states none",
    ),
    column("error_percent", "%", "error_mpa over e_app_mpa"),
    column(
        "met",
        "",
        "whether the error asked for (--error) is met; NA where none was asked for",
    ),
    column(
        "method",
        "",
        "floppy, firm, ffb, graded, voxel-fe, graded-extrapolated, voxel-fe-extrapolated",
    ),
    column(
        "element_mm",
        "mm",
        "lattice parameter or element size; of a limit the finest that it follows from",
    ),
    YOUNG,
    POISSON,
    LOAD,
    ENDS,
    AXIS,
    GRIP,
    column(
        "stiffness_n_per_mm",
        "N/mm",
        "force over the displacement of the ends, E_app A / L",
    ),
    column("force_n", "N", "force at the strain applied, a magnitude"),
    FAILURE_LOAD,
    column(
        "yield_stress_mpa",
        "MPa",
        "apparent yield stress; NA until there are nonlinear solves",
    ),
    column(
        "threshold_sensitivity",
        "",
        "relative change of e_app_mpa per relative change of BV, where it was estimated",
    ),
    column("note", "", "what a reader must know of this number"),
];

const RESULTS: [Column; 47] = [
    SCAN,
    column("method", "", "lattice, voxel-fe or geometry-fe"),
    column(
        "structure",
        "",
        "sc, bcc, fcc (lattices), hex8 (voxel elements) or tet10 (smooth elements)",
    ),
    column(
        "boundary",
        "",
        "how a lattice meets the bone's surface: floppy, firm, graded; ffb: mean of floppy and firm; extrapolated: limit of several resolutions",
    ),
    column(
        "lp_mm",
        "mm",
        "lattice parameter; of voxel-fe and geometry-fe the element size",
    ),
    column("registration", "mm", "shift of the lattice, x;y;z"),
    column("voxel_mm", "mm", "voxel edge; x;y;z where they differ"),
    YOUNG,
    POISSON,
    LOAD,
    ENDS,
    AXIS,
    column("strain", "", "nominal strain; negative is compression"),
    GRIP,
    column("tv_definition", "", "what TV is: box, cylinder, mask"),
    column("tv_mm3", "mm³", "volume of interest, pores included"),
    BV_TV,
    column("sites", "", "lattice sites or elements that carry load"),
    column(
        "dropped_sites",
        "",
        "sites or elements left out because nothing connects them to both ends",
    ),
    column("unknowns", "", "degrees of freedom"),
    column("iterations", "", "of the solver"),
    column("residual", "", "relative residual at the end"),
    column(
        "converged",
        "",
        "whether the error of the solver is below `tolerance`",
    ),
    column(
        "e_app_mpa",
        "MPa",
        "the result: from the energy (floppy, graded, voxel-fe), from the stress of the fully coordinated sites (firm)",
    ),
    column(
        "e_app_reaction_mpa",
        "MPa",
        "for checks: from the force at the ends. Of firm rows far too large, since padded sites outside the bone carry load: use e_app_mpa",
    ),
    column(
        "e_app_stress_mpa",
        "MPa",
        "for checks: from the mean stress of all sites (firm: of the fully coordinated ones)",
    ),
    column(
        "algebraic_error_mpa",
        "MPa",
        "estimated error that the solver left in e_app_mpa",
    ),
    column(
        "discretization_error_mpa",
        "MPa",
        "estimated error of the resolution; of ffb half the gap between floppy and firm, NA where they are shown to be no bracket",
    ),
    column(
        "wall_s",
        "s",
        "wall time of the solve; of means and limits the sum",
    ),
    column(
        "peak_mib",
        "MiB",
        "largest memory of the program during the solve",
    ),
    column(
        "mean_thickness_mm",
        "mm",
        "quick estimate of strut thickness, 2 BV / BS (of plates); tb_th_mm is measured by spheres and larger",
    ),
    column("tolerance", "", "relative algebraic error allowed"),
    column("note", "", "what a reader must know of this row"),
    GROUP,
    SUBJECT,
    column(
        "mechanisms",
        "",
        "zero-energy modes, where --mechanisms counts them",
    ),
    column(
        "material",
        "",
        "law by which tissue differs from voxel to voxel",
    ),
    FAILURE_LOAD,
    column(
        "failure_factor",
        "",
        "what the load applied is multiplied by to fail",
    ),
    column(
        "tb_th_mm",
        "mm",
        "Tb.Th: mean diameter of the largest spheres in bone (--morphometry)",
    ),
    column("tb_sp_mm", "mm", "Tb.Sp: the same of pores"),
    column("conn_d_per_mm3", "1/mm³", "Conn.D: connectivity density"),
    column(
        "da",
        "",
        "DA: degree of anisotropy by mean intercept lengths, 1 is isotropic",
    ),
    column(
        "elements",
        "",
        "what elements follow from: voxels, interpolated-grey, smoothed-grey, split-voxels, block-means, bone-fractions; of geometry-fe smooth-grey (grey values) or smooth-mask (a guess)",
    ),
    column(
        "shape_error_mpa",
        "MPa",
        "what voxels and the scan's blur leave open about the bone's surface",
    ),
    column(
        "error_mpa",
        "MPa",
        "all that is stated of e_app_mpa: algebraic, discretisation and shape error",
    ),
    column(
        "threshold_sensitivity",
        "",
        "relative change of E_app per relative change of bone volume",
    ),
];

const FAILED: [Column; 3] = [
    SCAN,
    column("input", "", "path of the scan"),
    column("reason", "", "the message, on one line"),
];

const HISTORY: [Column; 1] = [column("t", "", "time of the scene, in its own unit")];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::table::to_csv;
    use crate::record::failures::Failure;
    use crate::result::answer::AnswerLine;
    use crate::result::row::Row;
    use std::collections::BTreeSet;

    /// A column of a file is described, and what is described is a column.
    #[test]
    fn every_column_is_described_once_and_in_order() {
        for (name, header) in [
            ("results.csv", to_csv::<Row>(&[])),
            ("answers.csv", to_csv::<AnswerLine>(&[])),
            ("failed.csv", to_csv::<Failure>(&[])),
        ] {
            let file = FILES.iter().find(|f| f.name == name).unwrap();
            let described: Vec<&str> = file.columns.iter().map(|c| c.name).collect();
            let columns: Vec<&str> = header.trim().split(',').collect();
            let missing: BTreeSet<_> = columns.iter().filter(|c| !described.contains(c)).collect();
            assert!(
                missing.is_empty(),
                "{name}: `bonepd-ct columns` lacks {missing:?}"
            );
            assert_eq!(described, columns, "{name}");
        }
    }

    #[test]
    fn units_are_those_of_the_names() {
        for Column { name, unit, .. } in FILES.iter().flat_map(|f| f.columns) {
            let by_name = [
                ("_mpa", "MPa"),
                ("_mm", "mm"),
                ("_mm3", "mm³"),
                ("_n", "N"),
                ("_s", "s"),
                ("_mib", "MiB"),
            ];
            let per = name.contains("_per_");
            if let Some((_, expected)) = by_name.iter().find(|(end, _)| name.ends_with(end) && !per)
            {
                assert_eq!(unit, expected, "{name}");
            }
        }
    }
}
