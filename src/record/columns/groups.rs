//! Owns what the columns of the report's tables of groups and of stiffness mean.

use crate::record::column::{Column, GROUP, SCAN, SUBJECT, column};

const QUANTITY: Column = column(
    "quantity",
    "",
    "E_app (MPa), failure load (N) or BV/TV: the unit of the numbers of this row",
);

pub const GROUPS: [Column; 10] = [
    QUANTITY,
    column("group", "", "from the manifest; `all` without groups"),
    column("scans", "", "scans of the group that have an answer"),
    column(
        "n",
        "",
        "subjects; a subject's value is the mean of its scans",
    ),
    column("mean", "", "mean of the subjects"),
    column("sd", "", "standard deviation of the subjects"),
    column(
        "mean_low",
        "",
        "95 % confidence interval of the mean (Student's t), lower end",
    ),
    column("mean_high", "", "the same, upper end"),
    column("median", "", "median of the subjects"),
    column(
        "mean_error",
        "",
        "mean of the subjects' stated errors, each the mean of its scans; NA where a scan states none",
    ),
];

pub const COMPARISONS: [Column; 17] = [
    QUANTITY,
    column("group", "", "one group"),
    column("other", "", "the group that it is compared with"),
    column(
        "design",
        "",
        "independent: Welch and Mann–Whitney; paired: the same subjects in both groups",
    ),
    column("difference", "", "mean of `group` less mean of `other`"),
    column(
        "difference_low",
        "",
        "95 % confidence interval of the difference, lower end",
    ),
    column("difference_high", "", "the same, upper end"),
    column("ratio", "", "mean of `group` over mean of `other`"),
    column("p_t", "", "p of the t test, two-sided"),
    column(
        "p_mann_whitney",
        "",
        "p of the Mann–Whitney test, two-sided",
    ),
    column(
        "p_t_holm",
        "",
        "p_t corrected by Holm for all pairs of groups of this quantity",
    ),
    column(
        "p_mann_whitney_holm",
        "",
        "p_mann_whitney corrected by Holm",
    ),
    column(
        "hedges_g",
        "",
        "effect size: difference over the pooled standard deviation, corrected for small samples",
    ),
    column(
        "hedges_g_low",
        "",
        "95 % confidence interval of hedges_g, lower end",
    ),
    column("hedges_g_high", "", "the same, upper end"),
    column(
        "widened_low",
        "",
        "difference_low if all scans of one group were too high and all of the other too low by their stated errors",
    ),
    column("widened_high", "", "difference_high in the same worst case"),
];

pub const STIFFNESS: [Column; 19] = [
    SCAN,
    SUBJECT,
    GROUP,
    column("conditions", "", "boundary conditions of the unit strains"),
    column(
        "element_mm",
        "mm",
        "edge of an element; x;y;z where they differ",
    ),
    column("bv_tv", "", "bone volume fraction, 0 to 1"),
    column(
        "e1_mpa",
        "MPa",
        "Young's modulus along the first axis of the best orthotropic frame",
    ),
    column("e2_mpa", "MPa", "along the second axis"),
    column("e3_mpa", "MPa", "along the third axis"),
    column("g23_mpa", "MPa", "shear modulus in the plane of axes 2, 3"),
    column("g13_mpa", "MPa", "in the plane of axes 1, 3"),
    column("g12_mpa", "MPa", "in the plane of axes 1, 2"),
    column(
        "nu23",
        "",
        "Poisson's ratio: strain along 3 under stress along 2",
    ),
    column("nu13", "", "strain along 3 under stress along 1"),
    column("nu12", "", "strain along 2 under stress along 1"),
    column(
        "not_orthotropic",
        "",
        "share of the tensor that no orthotropic tensor of this frame holds, 0 to 1",
    ),
    column(
        "axis1",
        "",
        "unit vector of the first axis in the axes of the scan, x;y;z",
    ),
    column("axis2", "", "the second axis"),
    column("axis3", "", "the third axis"),
];
