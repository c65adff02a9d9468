//! Owns the supports of any model: grips and sides where ends move, all faces under unit strains.

use crate::measure::stiffness::unit_strain;
use crate::operator::held::Held;
use crate::pipeline::apparent::ends::motion::EndMotion;
use crate::pipeline::apparent::ends::reactions::End;
use crate::pipeline::apparent::params::{Conditions, Load};

/// A node, or site, as supports see it.
pub struct Node {
    /// From the corner of the specimen.
    pub place_mm: [f64; 3],
    /// Whether it lies on a side across each axis.
    pub on_side: [bool; 3],
    /// The end whose grip holds it.
    pub end: Option<End>,
    /// How far it lies from the lower grip to the upper: 0 to 1.
    pub along: f64,
}

/// The nodes of a model between its grips.
pub trait Nodes {
    /// Length of its vectors.
    fn count(&self) -> usize;

    /// Calls `visit` with every node and its number.
    fn each(&self, visit: impl FnMut(usize, Node));

    /// Nothing held but numbers that are no node's.
    fn padding(&self) -> Held {
        Held::none(self.count())
    }
}

/// Unknowns that a motion of the ends holds, padding among them.
pub fn held(nodes: &impl Nodes, motion: &EndMotion, load: Load) -> Held {
    let axis = motion.axis.index();
    hold(nodes, |node, c| {
        let confined = load == Load::Confined && c != axis && node.on_side[c];
        confined || node.end.is_some() && (c == axis || motion.held_sideways)
    })
}

/// The components of `u = ε x` that a load prescribes on the faces, and padding.
pub fn held_faces(nodes: &impl Nodes, conditions: Conditions, load: usize) -> Held {
    hold(nodes, |node, c| {
        (0..3).any(|face| node.on_side[face] && prescribed(conditions, load, face, c))
    })
}

fn hold(nodes: &impl Nodes, is_held: impl Fn(&Node, usize) -> bool) -> Held {
    let mut held = nodes.padding();
    nodes.each(|n, node| {
        let components = (0..3).filter(|c| is_held(&node, *c));
        components.for_each(|c| held.hold(n, c));
    });
    held
}

/// A start that meets these supports: the ends' motion, spread evenly between them. In mm.
pub fn start(nodes: &impl Nodes, motion: &EndMotion) -> Vec<[f64; 3]> {
    field(nodes, |node| motion.at(node.place_mm, node.along))
}

/// `u = ε x` of a unit strain in mm, `x` from the middle of a box of this size.
pub fn affine(nodes: &impl Nodes, size_mm: [f64; 3], load: usize) -> Vec<[f64; 3]> {
    let strain = unit_strain(load);
    field(nodes, |node| {
        let x: [f64; 3] = std::array::from_fn(|a| node.place_mm[a] - 0.5 * size_mm[a]);
        strain.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
    })
}

/// Zero in padding.
fn field(nodes: &impl Nodes, at: impl Fn(&Node) -> [f64; 3]) -> Vec<[f64; 3]> {
    let mut u = vec![[0.0; 3]; nodes.count()];
    nodes.each(|n, node| u[n] = at(&node));
    u
}

/// Calls `visit` with every gripped node, which end it is of, and its place in mm.
pub fn each_end_node(nodes: &impl Nodes, visit: &mut dyn FnMut(usize, End, [f64; 3])) {
    nodes.each(|n, node| {
        if let Some(end) = node.end {
            visit(n, end, node.place_mm);
        }
    });
}

/// Whether a unit strain prescribes a component of `u = ε x` on the faces across an axis.
fn prescribed(conditions: Conditions, load: usize, face: usize, component: usize) -> bool {
    match (conditions, load) {
        (Conditions::Kinematic, _) => true,
        (Conditions::Mixed, 0..3) => component == face,
        // Shear in the plane of p and q, out of it r: p's faces carry u_q and u_r, q's u_p and u_r, r's u_r.
        (Conditions::Mixed, _) => {
            let out = load - 3;
            component == out || face != out && component != face
        }
        (Conditions::Symshear, 0..3) => component == face,
        // p's and q's faces carry u_p and u_q, r's u_r.
        (Conditions::Symshear, _) => (component == load - 3) == (face == load - 3),
    }
}
