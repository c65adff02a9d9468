//! Owns what a methods section says of loads and ends.

use super::words::{list, setting};
use crate::result::condition::Condition;
use crate::result::settings::{Conditions, Ends, Load, Motion, Supports};

/// The load of the answers, and those of other rows of the same scans.
pub fn text(condition: &Condition, others: &[Condition]) -> String {
    let mut text = load(condition);
    if condition.load.has_modulus() {
        text += match condition.load {
            Load::Stiffness => "",
            _ => {
                " The apparent modulus E_app is the stiffness times the free length over the cross-section of the volume of interest, pores included."
            }
        };
    }
    if !others.is_empty() {
        let differ: Vec<String> = others
            .iter()
            .map(|other| other.difference(condition))
            .collect();
        text += &format!(
            " Further solves of these scans, under other conditions, are not described here ({}).",
            list(&differ)
        );
    }
    text
}

fn load(c: &Condition) -> String {
    let axis = c.axis.name();
    let Some(motion) = c.load.motion() else {
        let faces = match c.supports {
            Supports::Faces(conditions) => conditions,
            Supports::Ends(_) | Supports::Labels => Conditions::default(),
        };
        return format!(
            "The apparent stiffness matrix followed from six unit strains under {}. E_app is Young's modulus along {axis} of that matrix.",
            faces_in_words(faces)
        );
    };
    let grips = match (c.grip_mm > 0.0, &c.held_by) {
        (true, _) => Some(format!("the outer {} mm", setting(c.grip_mm))),
        (false, held) => held.clone(),
    };
    let angle = c.angle_deg.unwrap_or_default();
    let share = setting(100.0 * c.strain.abs());
    match motion {
        Motion::Along => along(c, grips.as_deref()),
        Motion::ByLabel => format!(
            "Nodes at the corners of labelled voxels were held, moved or pushed: {} (displacements in mm; forces in N, spread evenly over the nodes of a label).",
            c.held_by.as_deref().unwrap_or_default()
        ),
        Motion::Sideways(direction) => held(
            &format!(
                "Specimens were sheared: the upper end moved along {} by {share} % of the height along {axis}",
                direction.name()
            ),
            grips.as_deref(),
        ),
        Motion::Tilt(about) => held(
            &format!(
                "Specimens were bent about {}: both ends across {axis} tilted by {}° in opposite directions",
                about.name(),
                setting(0.5 * angle)
            ),
            grips.as_deref(),
        ),
        Motion::Turn => held(
            &format!(
                "Specimens were twisted: the upper end turned by {}° about {axis}, through the middle of the volume",
                setting(angle)
            ),
            grips.as_deref(),
        ),
    }
}

fn held(motion: &str, grips: Option<&str>) -> String {
    let ends = match grips {
        Some(what) => format!("{what} at both ends were held in all components"),
        None => "both end planes were held in all components".to_owned(),
    };
    format!("{motion}; {ends}; the sides were free.")
}

fn along(c: &Condition, grips: Option<&str>) -> String {
    let direction = match c.strain < 0.0 {
        true => "compressed",
        false => "stretched",
    };
    let ends = match grips {
        Some(what) => format!("{what} at each end moved as one along the axis"),
        None => "the end planes moved along the axis".to_owned(),
    };
    let sideways = match c.supports {
        Supports::Ends(Ends::Bonded) => "and were held sideways (bonded)",
        _ => "and were free to slide sideways without friction",
    };
    let sides = match c.load {
        Load::Confined => "the sides were held against outward motion (confined)",
        _ => "the sides were free",
    };
    format!(
        "Specimens were {direction} along {} by {} % of the free length: {ends} {sideways}; {sides}.",
        c.axis.name(),
        setting(100.0 * c.strain.abs())
    )
}

fn faces_in_words(conditions: Conditions) -> &'static str {
    match conditions {
        Conditions::Kinematic => {
            "kinematic uniform boundary conditions (all faces move as the homogeneous strain; an upper bound)"
        }
        Conditions::Mixed => {
            "periodicity-compatible mixed uniform boundary conditions (Pahr and Zysset 2008)"
        }
        Conditions::Symshear => {
            "rollers on all faces for normal strains and symmetric shear of four faces for shear strains"
        }
    }
}
