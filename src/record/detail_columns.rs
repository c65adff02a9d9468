//! Owns the data dictionary of the tidy tables next to `results.csv`.

use crate::record::column::{
    ANGLE, AXIS, BOUNDARY, Column, ENDS, FAILURE_DISPLACEMENT, FAILURE_FACTOR, FAILURE_LOAD,
    FAILURE_MOMENT, FAILURE_STRAIN, File, GRIP, LOAD, LP, METHOD, POISSON, SCAN, SED, STEPS,
    STRAIN, STRUCTURE, TOLERANCE, YOUNG, column,
};

/// Columns that say which solve a line is of.
const OF: [Column; 16] = [
    SCAN, METHOD, STRUCTURE, BOUNDARY, LP, YOUNG, POISSON, LOAD, ENDS, AXIS, STRAIN, ANGLE, GRIP,
    TOLERANCE, SED, STEPS,
];

/// Those, and `own`. `N` is the number of both.
const fn with<const N: usize>(own: &[Column]) -> [Column; N] {
    let mut all = [SCAN; N];
    let mut i = 0;
    while i < N {
        all[i] = if i < OF.len() {
            OF[i]
        } else {
            own[i - OF.len()]
        };
        i += 1;
    }
    all
}

pub const REACTIONS: File = File {
    name: "reactions.csv",
    about: "forces and moments that the supports put on both ends, one line an end; signed, along the specimen's axes; off to first order in the solver's error, so solve with --tolerance 1e-8 where they must balance",
    columns: &with::<26>(&[
        column("end", "", "lower or upper, along the long axis"),
        column("force_x_n", "N", "of the supports on the end"),
        column("force_y_n", "N", "the same along y"),
        column("force_z_n", "N", "the same along z"),
        column(
            "moment_x_nmm",
            "N mm",
            "about the middle of the grid at this end's innermost plane",
        ),
        column("moment_y_nmm", "N mm", "the same about y"),
        column("moment_z_nmm", "N mm", "the same about z"),
        column(
            "about_x_mm",
            "mm",
            "what the moment is about, from the specimen's corner",
        ),
        column("about_y_mm", "mm", "the same along y"),
        column("about_z_mm", "mm", "the same along z"),
    ]),
};

pub const LABELS: File = File {
    name: "labels.csv",
    about: "what labels that are held, moved and pushed come to, one line a label; signed, along the specimen's axes; off to first order in the solver's error, so solve with --tolerance 1e-8 where forces must balance",
    columns: &with::<32>(&[
        column("label", "", "value of the label image"),
        column("role", "", "held, moved or pushed"),
        column("nodes", "", "nodes of bone at the corners of its voxels"),
        column("force_x_n", "N", "force from outside on its nodes"),
        column("force_y_n", "N", "the same along y"),
        column("force_z_n", "N", "the same along z"),
        column(
            "moment_x_nmm",
            "N mm",
            "moment of those forces about the mean place of the nodes",
        ),
        column("moment_y_nmm", "N mm", "the same about y"),
        column("moment_z_nmm", "N mm", "the same about z"),
        column(
            "about_x_mm",
            "mm",
            "mean place of the nodes, from the specimen's corner",
        ),
        column("about_y_mm", "mm", "the same along y"),
        column("about_z_mm", "mm", "the same along z"),
        column("displacement_x_mm", "mm", "mean displacement of the nodes"),
        column("displacement_y_mm", "mm", "the same along y"),
        column("displacement_z_mm", "mm", "the same along z"),
        column(
            "work_nmm",
            "N mm",
            "force times displacement, over the nodes: half the sum of all labels is the elastic energy",
        ),
    ]),
};

const LABEL: Column = column(
    "label",
    "",
    "tissue, by its label in the scan; all for the whole bone",
);
const ELEMENTS: Column = column("elements", "", "how many elements");

pub const FAILURE: File = File {
    name: "failure.csv",
    about: "failure by Pistoia's criterion at several critical volumes, where --failure asks for it",
    columns: &with::<26>(&[
        column(
            "critical_volume",
            "",
            "share of the bone that must exceed the critical strain",
        ),
        column("critical_strain", "", "effective strain sqrt(2 SED / E)"),
        column(
            "labels",
            "",
            "labels whose bone counts; all for every voxel",
        ),
        column(
            "strain_at_volume",
            "",
            "effective strain that the critical volume exceeds under the load applied",
        ),
        column("factor", "", FAILURE_FACTOR),
        FAILURE_LOAD,
        FAILURE_MOMENT,
        FAILURE_DISPLACEMENT,
        FAILURE_STRAIN,
        column(
            "failure_angle_deg",
            "°",
            "angle of the ends at failure, a magnitude; of bending and torsion",
        ),
    ]),
};

pub const SECTIONS: File = File {
    name: "sections.csv",
    about: "what each tissue carries through a layer of elements at both ends and in the middle, where --statistics asks for it",
    columns: &with::<22>(&[
        column("section", "", "lower, middle, upper"),
        LABEL,
        ELEMENTS,
        column(
            "force_n",
            "N",
            "along the displacement of the ends, signed; NA under bending and torsion",
        ),
        column(
            "moment_nmm",
            "N mm",
            "about the middle of the grid, signed; of bending and torsion",
        ),
        column("share", "", "of the section's force or moment"),
    ]),
};

pub const YIELDED: File = File {
    name: "yielded.csv",
    about: "what has flowed of each tissue at the end of the load, where --plasticity is given",
    columns: &with::<21>(&[
        LABEL,
        ELEMENTS,
        column(
            "yielded_share",
            "",
            "share of the volume that has ever flowed, by integration points",
        ),
        column(
            "maximum_plastic_strain",
            "",
            "largest equivalent plastic strain √(2/3 ε:ε), means of elements",
        ),
        column(
            "mean_plastic_strain",
            "",
            "the same, mean over all elements",
        ),
    ]),
};

pub const CURVE: File = File {
    name: "curve.csv",
    about: "the stress-strain curve of the last solve with --plasticity, one line a load step; signed as the strain",
    columns: &[
        column("step", "", "number of the load step, from 1"),
        column(
            "strain",
            "",
            "nominal: displacement over the distance of the ends",
        ),
        column(
            "stress_mpa",
            "MPa",
            "force over the whole end area, pores included",
        ),
        column(
            "force_n",
            "N",
            "along the displacement of the ends, from the work of the step",
        ),
        column(
            "plastic_volume_fraction",
            "",
            "share of the bone that has ever flowed",
        ),
        column("energy_mj", "mJ", "stored elastically now"),
        column("dissipated_mj", "mJ", "by plastic flow since the start"),
        column(
            "work_mj",
            "mJ",
            "of the ends since the start: mean force of a step times its displacement",
        ),
        column("iterations", "", "of conjugate gradients in this step"),
    ],
};

pub const IN_VIVO: File = File {
    name: "in_vivo.csv",
    about: "daily loads that even out the tissue's loading, one line a unit load, of a run whose recipe has in_vivo_mpa",
    columns: &[
        SCAN,
        LOAD,
        column("unit", "", "of unit_load and amplitude: N, or N mm"),
        column(
            "unit_load",
            "",
            "force or moment of the load that was solved",
        ),
        column("amplitude", "", "the estimate: with which this load acts"),
        column(
            "factor",
            "",
            "of the energy field over the square of the unit load: the amplitude squared",
        ),
        column("energy_share", "", "share in the combined energy, 0 to 1"),
        column("target_mpa", "MPa", "energy density that was aimed at"),
        column(
            "mean_mpa",
            "MPa",
            "mean of the combined field (field-sed-in-vivo-mpa), capped at its 95th percentile",
        ),
        column("sd_mpa", "MPa", "standard deviation of that field"),
        column(
            "failure_factor",
            "",
            "what these loads are multiplied by to fail by Pistoia's criterion, of the combined field",
        ),
    ],
};

pub const FABRIC_FIT: File = File {
    name: "fabric_fit.csv",
    about: "the law of Zysset and Curnier fitted to the tensors of at least five scans with measured fabric (in the report's folder)",
    columns: &[
        column("conditions", "", "boundary conditions of the tensors"),
        column(
            "parameter",
            "",
            "E0, nu0, G0, k, l of E_i = E0 rho^k m_i^2l, nu_ij / E_i = nu0 / (E0 rho^k (m_i m_j)^l), G_ij = G0 rho^k (m_i m_j)^l",
        ),
        column(
            "unit",
            "",
            "of value, low and high; empty for exponents and nu0",
        ),
        column("value", "", "the estimate"),
        column("low", "", "lower end of the 95 % confidence interval"),
        column("high", "", "upper end"),
        column("scans", "", "tensors, of nine constants each"),
        column("r2", "", "coefficient of determination of the logarithms"),
        column(
            "scatter_percent",
            "",
            "one standard deviation of the logarithms, in % of the value",
        ),
    ],
};

pub const TISSUE: File = File {
    name: "tissue.csv",
    about: "how strains and stresses are distributed over the elements of each tissue, where --statistics asks for it",
    columns: &with::<30>(&[
        LABEL,
        column(
            "quantity",
            "",
            "sed, effective_strain, von_mises, principal_strain_1 to 3 (largest first)",
        ),
        column("unit", "", "of the quantity; empty for strains"),
        ELEMENTS,
        column("mean", "", "by volume"),
        column("sd", "", "standard deviation, of all elements"),
        column("skewness", "", "third central moment over sd cubed"),
        column("minimum", "", "least value"),
        column("p5", "", "5th percentile"),
        column("p25", "", "25th percentile"),
        column("median", "", "50th percentile"),
        column("p75", "", "75th percentile"),
        column("p95", "", "95th percentile"),
        column("maximum", "", "largest value"),
    ]),
};
