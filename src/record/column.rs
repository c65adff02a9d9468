//! Owns what a data dictionary is made of, and the columns that several files share.

use serde::Serialize;

#[derive(Debug, Clone, Copy, Serialize)]
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

pub(super) const fn column(name: &'static str, unit: &'static str, about: &'static str) -> Column {
    Column { name, unit, about }
}

pub(super) const SCAN: Column = column(
    "scan",
    "",
    "name of the scan: of its file, its folder, or in the manifest",
);
pub(super) const METHOD: Column = column("method", "", "lattice, voxel-fe or geometry-fe");
pub(super) const STRUCTURE: Column = column(
    "structure",
    "",
    "sc, bcc, fcc (lattices), hex8 (voxel elements) or tet10 (smooth elements)",
);
pub(super) const BOUNDARY: Column = column(
    "boundary",
    "",
    "how a lattice meets the bone's surface: floppy, firm, graded (connected on sc, weighted on bcc and fcc); ffb: mean of floppy and firm; extrapolated: limit of several resolutions",
);
pub(super) const LP: Column = column(
    "lp_mm",
    "mm",
    "lattice parameter; of voxel-fe and geometry-fe the element size",
);
pub(super) const BV_TV: Column = column("bv_tv", "", "bone volume fraction, 0 to 1");
pub(super) const YOUNG: Column = column(
    "young_mpa",
    "MPa",
    "Young's modulus of the bone tissue; with `material` the bone's mean",
);
pub(super) const POISSON: Column = column("poisson", "", "Poisson's ratio of the bone tissue");
pub(super) const LOAD: Column = column(
    "load",
    "",
    "uniaxial (sides free), confined (sides held), stiffness (six unit strains); shear-x (direction), bending-x (axis of the tilt), torsion: both ends held in all components; labels: as column `supports` says",
);
pub(super) const ENDS: Column = column(
    "ends",
    "",
    "free: loaded ends slide sideways; bonded: they do not; of load stiffness: kinematic, mixed or symshear faces; labels where `load` is labels",
);
pub(super) const AXIS: Column = column(
    "axis",
    "",
    "the long axis: that of compression, from end to end",
);
pub(super) const GRIP: Column = column(
    "grip_mm",
    "mm",
    "thickness that is held at each end, along the axis (bonded ends: in all directions); 0: end planes only",
);
pub(super) const GROUP: Column = column("group", "", "from the manifest");
pub(super) const SUBJECT: Column = column("subject", "", "from the manifest: who the scan is of");
pub(super) const FAILURE_LOAD: Column = column(
    "failure_load_n",
    "N",
    "force at failure by Pistoia's criterion, a magnitude; where --failure asks for it; NA under bending and torsion",
);
pub(super) const STRAIN: Column = column(
    "strain",
    "",
    "nominal strain; negative is compression. 0 under bending, torsion and labels",
);
pub(super) const ANGLE: Column = column(
    "angle_deg",
    "°",
    "by how much the ends turn against each other under bending and torsion",
);
pub(super) const STIFFNESS: Column = column(
    "stiffness_n_per_mm",
    "N/mm",
    "force over the displacement of the ends; of compression E_app A / L. NA under bending and torsion. Of one label that is moved or pushed: its force over its displacement, both along what is prescribed; NA of several",
);
pub(super) const FORCE: Column = column(
    "force_n",
    "N",
    "force of the moved end along its displacement at the strain applied, a magnitude; of one label that is moved along its displacement, of one that is pushed its force",
);
pub(super) const MOMENT: Column = column(
    "moment_nmm",
    "N mm",
    "moment of the moved end about the axis of its turn, a magnitude; of bending the mean of both ends. NA otherwise",
);
pub(super) const FAILURE_MOMENT: Column = column(
    "failure_moment_nmm",
    "N mm",
    "moment at failure by Pistoia's criterion, a magnitude; of bending and torsion",
);
pub(super) const FAILURE_FACTOR: &str = "what the load applied is multiplied by to fail";
pub(super) const FAILURE_DISPLACEMENT: Column = column(
    "failure_displacement_mm",
    "mm",
    "displacement of the ends at failure, a magnitude",
);
pub(super) const FAILURE_STRAIN: Column = column(
    "failure_strain",
    "",
    "nominal strain at failure, a magnitude",
);
pub(super) const SED: Column = column(
    "sed",
    "",
    "strain energy density of elements, of which effective strains and failure follow: centre (of the strain at the centre) or mean (energy over volume)",
);
pub(super) const TOLERANCE: Column = column("tolerance", "", "relative algebraic error allowed");
pub(super) const STEPS: Column = column(
    "steps",
    "",
    "load steps of plasticity: a number of even ones, or adaptive (lengths follow the curve; adaptive/N divides them by N); failed ones are halved",
);
