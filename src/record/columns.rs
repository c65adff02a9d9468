//! Owns the data dictionary: what each column of the result files means, and its unit.

mod groups;
mod methods;

use crate::io::own_files;
use crate::record::column::{
    ANGLE, AXIS, BOUNDARY, BV_TV, ENDS, FAILURE_DISPLACEMENT, FAILURE_FACTOR, FAILURE_LOAD,
    FAILURE_MOMENT, FAILURE_STRAIN, FORCE, GRIP, GROUP, LOAD, LP, METHOD, MOMENT, POISSON, SCAN,
    SED, STEPS, STIFFNESS, STRAIN, STRUCTURE, SUBJECT, YOUNG, column,
};
pub use crate::record::column::{Column, File};
use crate::record::detail_columns;

/// All files, in the order in which readers meet them.
pub const FILES: [File; 21] = [
    File {
        name: own_files::ANSWERS,
        about: "one row for each scan: its apparent modulus with its stated error, from the row with the smallest stated error",
        columns: &ANSWERS,
    },
    File {
        name: own_files::RESULTS,
        about: "one row a solve, and rows that follow from several solves (boundary ffb, extrapolated)",
        columns: &RESULTS,
    },
    detail_columns::REACTIONS,
    detail_columns::LABELS,
    detail_columns::FAILURE,
    detail_columns::SECTIONS,
    detail_columns::TISSUE,
    detail_columns::YIELDED,
    detail_columns::CURVE,
    detail_columns::IN_VIVO,
    File {
        name: "groups.csv",
        about: "one row a quantity and group (in the report's folder)",
        columns: &groups::GROUPS,
    },
    File {
        name: "comparisons.csv",
        about: "one row a quantity and pair of groups (in the report's folder)",
        columns: &groups::COMPARISONS,
    },
    detail_columns::FABRIC_FIT,
    File {
        name: "stiffness.csv",
        about: "one row a scan whose stiffness was computed (in the report's folder; the tensor itself is in stiffness.json)",
        columns: &groups::STIFFNESS,
    },
    File {
        name: "e_app.csv",
        about: "one row a scan, structure and lattice parameter: the moduli by all methods (in the report's folder)",
        columns: &methods::E_APP,
    },
    File {
        name: "regressions.csv",
        about: "least squares of methods over scans, y = intercept + slope x (in the report's folder)",
        columns: &methods::REGRESSIONS,
    },
    File {
        name: "agreement.csv",
        about: "Bland and Altman's agreement of methods over scans, method less reference (in the report's folder)",
        columns: &methods::AGREEMENT,
    },
    File {
        name: "distributions.csv",
        about: "quartiles of the moduli over scans, by method and group (in the report's folder)",
        columns: &methods::DISTRIBUTIONS,
    },
    File {
        name: "anova.csv",
        about: "analysis of variance between methods, repeated over scans (in the report's folder)",
        columns: &methods::ANOVA,
    },
    File {
        name: own_files::FAILED,
        about: "scans of a run that have no results",
        columns: &FAILED,
    },
    File {
        name: "history.csv",
        about: "numbers of a two-dimensional scene over time; its other columns are listed in pipelines/README.md",
        columns: &HISTORY,
    },
];

const ANSWERS: [Column; 29] = [
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
        "floppy, firm, ffb, graded (connected on sc, weighted on bcc and fcc), voxel-fe, geometry-fe, graded-extrapolated, voxel-fe-extrapolated",
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
    STIFFNESS,
    FORCE,
    FAILURE_LOAD,
    column(
        "yield_stress_mpa",
        "MPa",
        "apparent yield stress by the 0.2 % offset; NA without --plasticity",
    ),
    column(
        "threshold_sensitivity",
        "",
        "relative change of e_app_mpa per relative change of BV, where it was estimated",
    ),
    column("note", "", "what a reader must know of this number"),
    ANGLE,
    MOMENT,
    FAILURE_MOMENT,
    YIELD_ERROR,
    MAX_STRESS,
    MAX_ERROR,
    column(
        "failure_load_error_n",
        "N",
        "stated error of failure_load_n: in relative terms that of the modulus of the row that found it; NA where that states none",
    ),
];

const RESULTS: [Column; 66] = [
    SCAN,
    METHOD,
    STRUCTURE,
    BOUNDARY,
    LP,
    column("registration", "mm", "shift of the lattice, x;y;z"),
    column("voxel_mm", "mm", "voxel edge; x;y;z where they differ"),
    YOUNG,
    POISSON,
    LOAD,
    ENDS,
    AXIS,
    STRAIN,
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
        "the result: from the energy (all but firm), from the stress of the fully coordinated sites (firm)",
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
        "estimated error of the resolution; of ffb half the gap between floppy and firm, NA where the answer was found not to lie between them",
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
    column("failure_factor", "", FAILURE_FACTOR),
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
        "what elements follow from: voxels, interpolated-grey, smoothed-grey, split-voxels, block-means, bone-fractions; of geometry-fe smooth-grey (grey values), smooth-deblurred (corrected for blur) or smooth-mask (a guess)",
    ),
    column(
        "shape_error_mpa",
        "MPa",
        "uncertainty of the bone's surface, from voxels and the scan's blur",
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
    column(
        "surface_energy_ratio",
        "",
        "strain energy density at the surface of the elements over that of all bone: shape_error_mpa scales with it",
    ),
    ANGLE,
    STIFFNESS,
    FORCE,
    MOMENT,
    column(
        "algebraic_error_percent",
        "%",
        "estimated error that the solver left in e_app_mpa, stiffness, force and moment",
    ),
    FAILURE_MOMENT,
    FAILURE_DISPLACEMENT,
    FAILURE_STRAIN,
    SED,
    column(
        "plasticity",
        "",
        "law by which tissue yields, as on the command line; NA where it is elastic",
    ),
    STEPS,
    column(
        "yield_stress_mpa",
        "MPa",
        "apparent stress at yield by the 0.2 % offset, a magnitude; NA where the curve ends before",
    ),
    column("yield_strain", "", "nominal strain at yield, a magnitude"),
    MAX_STRESS,
    YIELD_ERROR,
    MAX_ERROR,
    column(
        "model_bv_tv",
        "",
        "volume of the model that carries load over TV: cells of sites (connected, weighted: their bone) or elements; bv_tv is the bone's",
    ),
    SUPPORTS,
];

const SUPPORTS: Column = column(
    "supports",
    "",
    "which labels of an image are held, moved and pushed (numbers of each: labels.csv), or to which depth uneven ends are gripped; NA for plane ends",
);
const MAX_STRESS: Column = column(
    "max_stress_mpa",
    "MPa",
    "largest apparent stress of the curve, a magnitude",
);
const YIELD_ERROR: Column = column(
    "yield_stress_error_mpa",
    "MPa",
    "what finer load steps and elements would change of yield_stress_mpa, and what the solver left; where --error asks for it",
);
const MAX_ERROR: Column = column("max_stress_error_mpa", "MPa", "the same of max_stress_mpa");

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
    use crate::record::details::Line;
    use crate::record::failures::Failure;
    use crate::record::in_vivo::InVivoLine;
    use crate::record::stiffness::StiffnessLine;
    use crate::report::groups::{ComparisonLine, GroupLine};
    use crate::report::statistics::{AgreementLine, BoxLine, RegressionLine};
    use crate::report::table;
    use crate::result::answer::AnswerLine;
    use crate::result::details::{EndForces, FailureAt, LabelForces, SectionShare, TissueSpread};
    use crate::result::row::Row;
    use crate::result::statistics::anova::Anova;
    use crate::result::statistics::fabric_elasticity::FabricFitLine;
    use crate::result::strength::{CurvePoint, YieldedShare};
    use std::collections::BTreeSet;

    /// A column of a file is described, and what is described is a column.
    #[test]
    fn every_column_is_described_once_and_in_order() {
        for (name, header) in [
            ("results.csv", to_csv::<Row>(&[])),
            ("answers.csv", to_csv::<AnswerLine>(&[])),
            ("failed.csv", to_csv::<Failure>(&[])),
            ("e_app.csv", to_csv::<table::Line>(&[])),
            ("regressions.csv", to_csv::<RegressionLine>(&[])),
            ("agreement.csv", to_csv::<AgreementLine>(&[])),
            ("distributions.csv", to_csv::<BoxLine>(&[])),
            ("anova.csv", to_csv::<Anova>(&[])),
            ("groups.csv", to_csv::<GroupLine>(&[])),
            ("comparisons.csv", to_csv::<ComparisonLine>(&[])),
            ("stiffness.csv", to_csv::<StiffnessLine>(&[])),
            ("reactions.csv", to_csv::<Line<EndForces>>(&[])),
            ("labels.csv", to_csv::<Line<LabelForces>>(&[])),
            ("failure.csv", to_csv::<Line<FailureAt>>(&[])),
            ("sections.csv", to_csv::<Line<SectionShare>>(&[])),
            ("tissue.csv", to_csv::<Line<TissueSpread>>(&[])),
            ("yielded.csv", to_csv::<Line<YieldedShare>>(&[])),
            ("in_vivo.csv", to_csv::<InVivoLine>(&[])),
            ("fabric_fit.csv", to_csv::<FabricFitLine>(&[])),
            ("curve.csv", to_csv::<CurvePoint>(&[])),
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
                ("_nmm", "N mm"),
                ("_deg", "°"),
            ];
            let per = name.contains("_per_");
            if let Some((_, expected)) = by_name.iter().find(|(end, _)| name.ends_with(end) && !per)
            {
                assert_eq!(unit, expected, "{name}");
            }
        }
    }
}
