//! Owns what the columns of the tables that compare methods mean.

use crate::record::column::{BV_TV, Column, SCAN, YOUNG, column};

pub const E_APP: [Column; 23] = [
    SCAN,
    column(
        "structure",
        "",
        "sc, bcc, fcc (lattices), hex8 (voxel elements)",
    ),
    column(
        "lp_mm",
        "mm",
        "lattice parameter; of voxel elements their size",
    ),
    column(
        "condition",
        "",
        "the settings in which rows of this table differ",
    ),
    BV_TV,
    YOUNG,
    column("floppy_mpa", "MPa", "E_app of the floppy lattice"),
    column("firm_mpa", "MPa", "E_app of the firm lattice"),
    column("ffb_mpa", "MPa", "mean of both"),
    column(
        "graded_mpa",
        "MPa",
        "E_app of the connected (SC) or weighted (BCC, FCC) lattice",
    ),
    column("voxel_fe_mpa", "MPa", "E_app by voxel elements"),
    column("graded_extrapolated_mpa", "MPa", "limit of such lattices"),
    column(
        "voxel_fe_extrapolated_mpa",
        "MPa",
        "limit of voxel elements",
    ),
    column("geometry_fe_mpa", "MPa", "E_app by smooth elements"),
    column("floppy_over_tissue", "", "floppy_mpa over young_mpa"),
    column("firm_over_tissue", "", "firm_mpa over young_mpa"),
    column("ffb_over_tissue", "", "ffb_mpa over young_mpa"),
    column("graded_over_tissue", "", "graded_mpa over young_mpa"),
    column("voxel_fe_over_tissue", "", "voxel_fe_mpa over young_mpa"),
    column(
        "graded_extrapolated_over_tissue",
        "",
        "graded_extrapolated_mpa over young_mpa",
    ),
    column(
        "voxel_fe_extrapolated_over_tissue",
        "",
        "voxel_fe_extrapolated_mpa over young_mpa",
    ),
    column(
        "geometry_fe_over_tissue",
        "",
        "geometry_fe_mpa over young_mpa",
    ),
    column("wall_s", "s", "wall time of all solves of the row"),
];

pub const REGRESSIONS: [Column; 10] = [
    column("y", "", "quantity on the y axis, with its unit"),
    column("x", "", "quantity on the x axis, with its unit"),
    column("n", "", "scans"),
    column("slope", "", "in units of y over units of x"),
    column("intercept", "", "in units of y"),
    column("r2", "", "coefficient of determination"),
    column("slope_standard_error", "", "standard error of the slope"),
    column(
        "intercept_standard_error",
        "",
        "standard error of the intercept",
    ),
    column("slope_p", "", "p of slope 0, two-sided"),
    column("intercept_p", "", "p of intercept 0, two-sided"),
];

pub const AGREEMENT: [Column; 14] = [
    column("method", "", "the method"),
    column("reference", "", "what it is compared with"),
    column("n", "", "scans that have both"),
    column("bias", "", "mean difference, in MPa"),
    column("sd", "", "standard deviation of the differences, in MPa"),
    column("lower_limit", "", "bias less 1.96 sd, in MPa"),
    column("upper_limit", "", "bias plus 1.96 sd, in MPa"),
    column("bias_p", "", "p of bias 0 (paired t test), two-sided"),
    column(
        "bias_percent",
        "%",
        "mean of the differences over the mean of both",
    ),
    column("sd_percent", "%", "standard deviation of those"),
    column(
        "lower_limit_percent",
        "%",
        "bias_percent less 1.96 sd_percent",
    ),
    column(
        "upper_limit_percent",
        "%",
        "bias_percent plus 1.96 sd_percent",
    ),
    column(
        "slope_percent_per_mpa",
        "%/MPa",
        "slope of those differences over the mean of both",
    ),
    column("slope_p", "", "p of that slope 0, two-sided"),
];

pub const DISTRIBUTIONS: [Column; 9] = [
    column(
        "quantity",
        "",
        "E_app or E_app over BV/TV, in MPa, or the difference from the reference, in %",
    ),
    column("method", "", "the method"),
    column("group", "", "from the manifest; NA: all scans"),
    column("n", "", "scans"),
    column("min", "", "least value, in the unit of the quantity"),
    column("q1", "", "first quartile"),
    column("median", "", "median"),
    column("q3", "", "third quartile"),
    column("max", "", "largest value"),
];

pub const ANOVA: [Column; 8] = [
    column("specimens", "", "scans that all methods have"),
    column("methods", "", "methods"),
    column("f", "", "F"),
    column("df_methods", "", "degrees of freedom between methods"),
    column("df_error", "", "degrees of freedom of the error"),
    column("p", "", "p where sphericity holds"),
    column("epsilon", "", "Greenhouse and Geisser's epsilon"),
    column(
        "p_greenhouse_geisser",
        "",
        "p corrected by it: take this one",
    ),
];
