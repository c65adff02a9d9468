//! Owns the supports of voxel elements: grips and sides where ends move, all faces under unit strains.

use crate::discretisation::voxels::{Planes, VoxelMesh};
use crate::measure::stiffness::unit_strain;
use crate::operator::held::Held;
use crate::pipeline::apparent::discretisation::Displacements;
use crate::pipeline::apparent::ends::motion::EndMotion;
use crate::pipeline::apparent::ends::reactions::End;
use crate::pipeline::apparent::params::{Conditions, Load};

/// Unknowns that a motion of the ends holds, padding among them.
pub fn held(mesh: &VoxelMesh, grips: Planes, motion: &EndMotion, load: Load) -> Held {
    let axis = grips.axis.index();
    let mut held = Held::none(mesh.len());
    each_node(mesh, |node, at| {
        let exists = mesh.around[node] != 0;
        let gripped = at[axis] <= grips.low || at[axis] >= grips.high;
        for (c, &plane) in at.iter().enumerate() {
            let side = plane == 0 || plane == mesh.grid.n[c];
            let confined = load == Load::Confined && c != axis && side;
            let bonded = gripped && (c == axis || motion.held_sideways);
            if confined || bonded || !exists {
                held.hold(node, c);
            }
        }
    });
    held
}

/// A start that meets these supports: the ends' motion, spread evenly between them.
pub fn start(mesh: &VoxelMesh, grips: Planes, motion: &EndMotion) -> Displacements {
    let (axis, h) = (grips.axis.index(), mesh.grid.spacing_mm);
    let mut u = vec![[0.0; 3]; mesh.len()];
    each_node(mesh, |node, at| {
        if mesh.around[node] != 0 {
            let place_mm = std::array::from_fn(|a| at[a] as f64 * h[a]);
            u[node] = motion.at(place_mm, along(grips, at[axis]));
        }
    });
    u
}

/// Calls `visit` with every node of the gripped planes, which end it is of, and its place in mm.
pub fn each_end_node(mesh: &VoxelMesh, grips: Planes, visit: &mut dyn FnMut(usize, End, [f64; 3])) {
    let (axis, h) = (grips.axis.index(), mesh.grid.spacing_mm);
    each_node(mesh, |node, at| {
        let end = match at[axis] {
            plane if plane <= grips.low => End::Lower,
            plane if plane >= grips.high => End::Upper,
            _ => return,
        };
        if mesh.around[node] != 0 {
            visit(node, end, std::array::from_fn(|a| at[a] as f64 * h[a]));
        }
    });
}

/// How far a plane lies from the lower grip to the upper: 0 to 1.
pub fn along(grips: Planes, plane: usize) -> f64 {
    (plane.clamp(grips.low, grips.high) - grips.low) as f64 / (grips.high - grips.low) as f64
}

/// Whether a unit strain prescribes a component of `u = ε x` on the faces across an axis.
pub fn prescribed(conditions: Conditions, load: usize, face: usize, component: usize) -> bool {
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

/// The components of `u = ε x` that a load prescribes, and padding.
pub fn held_faces(mesh: &VoxelMesh, conditions: Conditions, load: usize) -> Held {
    let mut held = Held::none(mesh.len());
    each_node(mesh, |node, at| {
        let on = |face: &usize| at[*face] == 0 || at[*face] == mesh.grid.n[*face];
        for component in 0..3 {
            let stopped = (0..3)
                .filter(on)
                .any(|face| prescribed(conditions, load, face, component));
            if mesh.around[node] == 0 || stopped {
                held.hold(node, component);
            }
        }
    });
    held
}

/// Calls `f` with every node and its indices.
fn each_node(mesh: &VoxelMesh, mut f: impl FnMut(usize, [usize; 3])) {
    for segment in &mesh.segments {
        let [x, y, z] = segment.at.map(|v| v as usize);
        for (i, node) in segment.nodes().enumerate() {
            f(node, [x + i, y, z]);
        }
    }
}

/// `u = ε x` of a unit strain, `x` from the middle of the box.
pub fn affine(mesh: &VoxelMesh, load: usize) -> Displacements {
    let (strain, size) = (unit_strain(load), mesh.grid.size_mm());
    let mut u = vec![[0.0; 3]; mesh.len()];
    each_node(mesh, |node, at| {
        if mesh.around[node] != 0 {
            let x: [f64; 3] =
                std::array::from_fn(|a| at[a] as f64 * mesh.grid.spacing_mm[a] - 0.5 * size[a]);
            u[node] = strain.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2]);
        }
    });
    u
}

/// Node indices of every node.
pub fn grid_places(mesh: &VoxelMesh) -> Vec<[i32; 3]> {
    (0..mesh.len())
        .map(|node| mesh.indices(node).map(|v| v as i32))
        .collect()
}
