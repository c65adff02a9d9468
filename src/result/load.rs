//! Owns what is done to a specimen: its loads, how ends and faces are held, and which strain energy density is read.

use crate::grid::Axis;
use serde::{Deserialize, Serialize};

/// Column `load`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum Load {
    /// Ends nearer or apart along the axis, sides free.
    #[default]
    Uniaxial,
    /// Sides held against lateral motion.
    Confined,
    /// All six unit strains: the apparent stiffness matrix.
    Stiffness,
    /// The upper end moves sideways along x; both ends are held in all components, here and below.
    ShearX,
    /// The same along y.
    ShearY,
    /// The same along z.
    ShearZ,
    /// Both ends tilt about x, in opposite directions.
    BendingX,
    /// The same about y.
    BendingY,
    /// The same about z.
    BendingZ,
    /// The upper end turns about the load axis.
    Torsion,
    /// Supports and loads stand on the labels of an image.
    Labels,
}

/// What the ends do against each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Nearer or apart, along the load axis.
    Along,
    /// The upper end moves along this axis.
    Sideways(Axis),
    /// Both ends tilt about this axis.
    Tilt(Axis),
    /// The upper end turns about the load axis.
    Turn,
    /// Labels of an image are held, moved and pushed; there are no ends.
    ByLabel,
}

impl Motion {
    /// Whether an angle says how far, instead of a strain.
    pub fn is_by_angle(self) -> bool {
        matches!(self, Motion::Tilt(_) | Motion::Turn)
    }
}

impl Load {
    /// The words of settings and results, in the order of the variants.
    pub const WORDS: &[&str] = &[
        "uniaxial",
        "confined",
        "stiffness",
        "shear-x",
        "shear-y",
        "shear-z",
        "bending-x",
        "bending-y",
        "bending-z",
        "torsion",
        "labels",
    ];

    /// The word of settings and results.
    pub fn name(self) -> &'static str {
        Load::WORDS[self as usize]
    }

    /// None for the six unit strains, which move no ends.
    pub fn motion(self) -> Option<Motion> {
        Some(match self {
            Load::Stiffness => return None,
            Load::Uniaxial | Load::Confined => Motion::Along,
            Load::ShearX => Motion::Sideways(Axis::X),
            Load::ShearY => Motion::Sideways(Axis::Y),
            Load::ShearZ => Motion::Sideways(Axis::Z),
            Load::BendingX => Motion::Tilt(Axis::X),
            Load::BendingY => Motion::Tilt(Axis::Y),
            Load::BendingZ => Motion::Tilt(Axis::Z),
            Load::Torsion => Motion::Turn,
            Load::Labels => Motion::ByLabel,
        })
    }

    /// Whether an apparent modulus follows from it.
    pub fn has_modulus(self) -> bool {
        matches!(self.motion(), None | Some(Motion::Along))
    }

    /// Whether `--angle-deg` says how far the ends move.
    pub fn is_by_angle(self) -> bool {
        self.motion().is_some_and(Motion::is_by_angle)
    }
}

/// What the gripped sites may do sideways.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Ends {
    /// They slide without friction.
    #[default]
    Free,
    /// They are held.
    Bonded,
}

impl Ends {
    /// The word of settings and results.
    pub fn name(self) -> &'static str {
        match self {
            Ends::Free => "free",
            Ends::Bonded => "bonded",
        }
    }
}

/// What unit strains do on the faces of the volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Conditions {
    /// Every node on a face moves as the homogeneous strain says: an upper bound.
    #[default]
    Kinematic,
    /// Periodicity-compatible mixed uniform conditions (Pahr & Zysset 2008): faces slide as those of an orthotropic
    /// periodic cell do, close to what larger specimens show.
    Mixed,
    /// Normal strains as mixed. Shear in the plane of p and q, out of it r: the faces of p and q carry u_p and u_q of the
    /// homogeneous strain and are free along r, the faces of r have u_r = 0 (direct mechanics of Faim).
    Symshear,
}

impl Conditions {
    /// The words of settings and results, in the order of the variants.
    pub const WORDS: &[&str] = &["kinematic", "mixed", "symshear"];

    /// The word of settings and results.
    pub fn name(self) -> &'static str {
        Conditions::WORDS[self as usize]
    }

    /// As the report says it.
    pub fn in_words(self) -> &'static str {
        match self {
            Conditions::Kinematic => {
                "kinematic uniform boundary conditions (u = strain x on all faces; an upper bound)"
            }
            Conditions::Mixed => {
                "periodicity-compatible mixed uniform boundary conditions (Pahr & Zysset 2008)"
            }
            Conditions::Symshear => {
                "rollers on all faces under normal strains, symmetric shear of four faces (symshear, as Faim's direct mechanics)"
            }
        }
    }
}

/// Which strain energy density of an element is reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Sed {
    /// That of the strain at its centre, ½ σ:ε, which leaves out its bending: what Faim and ParOSol report.
    #[default]
    Centre,
    /// Its energy over its volume.
    Mean,
}

impl Sed {
    /// The words of settings and results, in the order of the variants.
    pub const WORDS: &[&str] = &["centre", "mean"];

    /// The word of settings and results.
    pub fn name(self) -> &'static str {
        Sed::WORDS[self as usize]
    }

    /// As the report says it.
    pub fn in_words(self) -> &'static str {
        match self {
            Sed::Centre => "of the strain at the element's centre",
            Sed::Mean => "mean over the element",
        }
    }
}
