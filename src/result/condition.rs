//! Owns what moduli must share to be compared: load, ends, axis, strain, grips and tissue; and its wording.

use crate::grid::Axis;
use crate::result::row::Row;
use crate::result::settings::{Conditions, Ends, Load, Motion, Settings, Supports};

/// What was done to a specimen, and of what tissue.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// What is done to the specimen.
    pub load: Load,
    /// How its ends or faces are held.
    pub supports: Supports,
    /// The load axis.
    pub axis: Axis,
    /// Nominal strain; negative is compression. 0 under bending and torsion.
    pub strain: f64,
    /// Of bending and torsion.
    pub angle_deg: Option<f64>,
    /// Thickness that is held at each end; 0: end planes only.
    pub grip_mm: f64,
    /// Poisson's ratio of the tissue.
    pub poisson: f64,
    /// Young's modulus of the tissue.
    pub tissue: Tissue,
    /// The law by which tissue yields; None where it stays elastic.
    pub plasticity: Option<String>,
    /// Labels that are held, moved and pushed, or how deep uneven ends are gripped.
    pub held_by: Option<String>,
}

/// Young's modulus of the tissue: one, or a law.
#[derive(Debug, Clone, PartialEq)]
pub enum Tissue {
    /// Young's modulus in MPa, everywhere.
    Uniform(f64),
    /// By this law from voxel to voxel.
    Law(String),
}

/// The program's default, a round number: not the modulus of bone tissue.
pub const DEFAULT_YOUNG_MPA: f64 = 1000.0;

impl Condition {
    /// The condition of a row's settings.
    pub fn of(key: &Settings) -> Condition {
        Condition {
            load: key.load,
            supports: key.supports,
            axis: key.axis,
            strain: key.strain,
            angle_deg: key.angle_deg,
            grip_mm: key.grip_mm,
            poisson: key.poisson,
            tissue: match &key.material {
                Some(law) => Tissue::Law(law.clone()),
                None => Tissue::Uniform(key.young_mpa),
            },
            plasticity: key.plasticity.clone(),
            held_by: key.held_by.clone(),
        }
    }

    /// Load and tissue.
    pub fn in_words(&self) -> String {
        format!("{} {}", self.load_in_words(), self.tissue_in_words())
    }

    /// The load in a sentence.
    pub fn load_in_words(&self) -> String {
        let axis = self.axis.name();
        if self.load == Load::Stiffness {
            let faces = match self.supports {
                Supports::Faces(conditions) => conditions,
                Supports::Ends(_) | Supports::Labels => Conditions::default(),
            };
            return format!(
                "Six unit strains under {}; E_app is Young's modulus along {axis} of the stiffness matrix.",
                faces.in_words()
            );
        }
        if let Some(words) = self.motion_in_words() {
            return words;
        }
        let direction = match self.strain < 0.0 {
            true => "Compression",
            false => "Tension",
        };
        let ends = match self.supports {
            Supports::Ends(Ends::Bonded) => "held sideways (bonded)",
            _ => "free to slide sideways (no friction)",
        };
        let grips = match self.grip_mm > 0.0 {
            true => format!(
                "the outer {} mm at each end move as rigid plates",
                self.grip_mm
            ),
            false => match &self.held_by {
                Some(held) => format!("uneven ends ({held}) move as one"),
                None => "the end planes are loaded".to_owned(),
            },
        };
        let sides = match self.load {
            Load::Confined => "the sides are held (confined)",
            _ => "the sides are free",
        };
        format!(
            "{direction} by {} % along {axis}: {grips} and are {ends}; {sides}.",
            rounded(100.0 * self.strain.abs())
        )
    }

    /// Shear, bending or torsion in a sentence.
    fn motion_in_words(&self) -> Option<String> {
        let (axis, angle) = (self.axis.name(), self.angle_deg.unwrap_or_default());
        let how = match self.load.motion()? {
            Motion::Along => return None,
            Motion::ByLabel => {
                return Some(format!(
                    "Supports and loads on the nodes of labels: {} (mm, N).",
                    self.held_by.as_deref().unwrap_or_default()
                ));
            }
            Motion::Sideways(direction) => format!(
                "Shear: the upper end moves along {} by {} % of the height along {axis}",
                direction.name(),
                rounded(100.0 * self.strain)
            ),
            Motion::Tilt(about) => format!(
                "Bending about {}: both end planes across {axis} tilt by {}° in opposite directions",
                about.name(),
                rounded(0.5 * angle)
            ),
            Motion::Turn => format!(
                "Torsion: the upper end turns by {angle}° about {axis} through the middle of the grid"
            ),
        };
        let grips = match (self.grip_mm > 0.0, &self.held_by) {
            (true, _) => format!(" (grips of {} mm)", self.grip_mm),
            (false, Some(held)) => format!(" ({held})"),
            (false, None) => String::new(),
        };
        Some(format!(
            "{how}; both ends are held in all components{grips}; the sides are free."
        ))
    }

    /// The tissue in sentences.
    pub fn tissue_in_words(&self) -> String {
        let yields = match &self.plasticity {
            Some(law) => format!(" It yields: {law} (yield stresses, then hardening, in MPa)."),
            None => String::new(),
        };
        self.elasticity_in_words() + &yields
    }

    fn elasticity_in_words(&self) -> String {
        match &self.tissue {
            Tissue::Law(law) => format!(
                "Tissue modulus by the law {law}, from voxel to voxel; Poisson's ratio {}.",
                self.poisson
            ),
            Tissue::Uniform(young) => {
                let default = match *young == DEFAULT_YOUNG_MPA {
                    true => ", the program's default and a round number, not a measurement",
                    false => "",
                };
                format!(
                    "Tissue modulus {young} MPa everywhere{default}; Poisson's ratio {}. E_app is proportional to the tissue modulus.",
                    self.poisson
                )
            }
        }
    }

    /// Where this differs from `other`, in a few words.
    pub fn difference(&self, other: &Condition) -> String {
        let mut words = Vec::new();
        let mut say = |differs: bool, text: String| {
            if differs {
                words.push(text);
            }
        };
        say(
            self.load != other.load,
            format!("load {}", self.load.name()),
        );
        say(
            self.supports != other.supports,
            format!("ends {}", self.supports.name()),
        );
        say(
            self.axis != other.axis,
            format!("axis {}", self.axis.name()),
        );
        say(
            self.strain != other.strain,
            format!("strain {}", self.strain),
        );
        say(
            self.angle_deg != other.angle_deg,
            match self.angle_deg {
                Some(angle) => format!("angle {angle}°"),
                None => "no angle".to_owned(),
            },
        );
        say(
            self.grip_mm != other.grip_mm,
            format!("grips of {} mm", self.grip_mm),
        );
        say(self.poisson != other.poisson, format!("ν {}", self.poisson));
        say(
            self.tissue != other.tissue,
            match &self.tissue {
                Tissue::Law(law) => format!("tissue {law}"),
                Tissue::Uniform(young) => format!("E {young} MPa"),
            },
        );
        say(
            self.plasticity != other.plasticity,
            match &self.plasticity {
                Some(law) => format!("yield {law}"),
                None => "elastic tissue".to_owned(),
            },
        );
        say(
            self.held_by != other.held_by,
            match &self.held_by {
                Some(words) => format!("supports {words}"),
                None => "plane ends".to_owned(),
            },
        );
        words.join(", ")
    }
}

/// The condition that most scans share; of several one with an apparent modulus, then the one of the last rows, which the last
/// command solved. None without rows.
pub fn shared(rows: &[&Row]) -> Option<Condition> {
    let mut found: Vec<(Condition, Vec<&str>)> = Vec::new();
    for row in rows {
        let condition = Condition::of(&row.key);
        let scan = row.key.scan.as_str();
        // The last one used moves to the end.
        let scans = match found.iter().position(|(c, _)| *c == condition) {
            Some(at) => found.remove(at).1,
            None => Vec::new(),
        };
        let known = scans.contains(&scan);
        let scans = scans.into_iter().chain((!known).then_some(scan));
        found.push((condition, scans.collect()));
    }
    let most = found
        .into_iter()
        .max_by_key(|(condition, scans)| (scans.len(), condition.load.has_modulus()));
    most.map(|(condition, _)| condition)
}

fn rounded(v: f64) -> f64 {
    (v * 1e6).round() / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(scan: &str, grip_mm: f64) -> Row {
        Row {
            key: Settings {
                scan: scan.to_owned(),
                grip_mm,
                strain: -0.0042,
                young_mpa: 1000.0,
                poisson: 0.3,
                ..Settings::default()
            },
            ..Row::default()
        }
    }

    #[test]
    fn conditions_are_said_in_sentences() {
        let c = Condition::of(&row("a", 0.6).key);
        assert_eq!(
            c.load_in_words(),
            "Compression by 0.42 % along z: the outer 0.6 mm at each end move as rigid plates and are free to slide sideways (no friction); the sides are free."
        );
        assert!(
            c.tissue_in_words()
                .contains("1000 MPa everywhere, the program's default")
        );
        let other = Condition::of(&row("a", 0.0).key);
        assert_eq!(c.difference(&other), "grips of 0.6 mm");
    }

    #[test]
    fn most_scans_decide_and_then_the_last_rows() {
        let rows = [row("a", 0.6), row("b", 0.6), row("b", 0.0)];
        let grip = |rows: &[Row]| shared(&rows.iter().collect::<Vec<_>>()).map(|c| c.grip_mm);
        assert_eq!(grip(&rows), Some(0.6));
        assert_eq!(grip(&rows[1..]), Some(0.0));
        assert_eq!(grip(&[]), None);
    }
}
