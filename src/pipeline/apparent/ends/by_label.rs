//! Owns supports and loads on the labels of an image: which nodes are held, moved and pushed, and what they come to.

use crate::discretisation::voxels::VoxelMesh;
use crate::error::{Error, Result};
use crate::measure::apparent::EndWork;
use crate::operator::held::Held;
use crate::pipeline::apparent::ends::label_image::LabelMap;
use crate::pipeline::apparent::ends::pieces::Pieces;
use crate::pipeline::apparent::ends::reactions::cross;
use crate::pipeline::apparent::params::SolveParams;
use crate::result::details::LabelForces;
use crate::solver::cg::CgInfo;

/// What a label's nodes do.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Role {
    /// These components stay at 0.
    Held([bool; 3]),
    /// Displaced by so many mm; None: free.
    Moved([Option<f64>; 3]),
    /// Share this force in N.
    Pushed([f64; 3]),
}

impl Role {
    fn name(self) -> &'static str {
        match self {
            Role::Held(_) => "held",
            Role::Moved(_) => "moved",
            Role::Pushed(_) => "pushed",
        }
    }

    /// The value that a component is kept at.
    fn prescribed(self, component: usize) -> Option<f64> {
        match self {
            Role::Held(held) => held[component].then_some(0.0),
            Role::Moved(by) => by[component],
            Role::Pushed(_) => None,
        }
    }

    /// Whether it strains the body.
    fn drives(self) -> bool {
        match self {
            Role::Held(_) => false,
            Role::Moved(by) => by.iter().flatten().any(|v| *v != 0.0),
            Role::Pushed(_) => true,
        }
    }
}

/// The nodes of one label of the settings.
struct Group {
    label: i32,
    role: Role,
    /// In rising order.
    nodes: Vec<usize>,
}

impl Group {
    /// The force that pushes each node; None where nodes are held or moved.
    fn share(&self) -> Option<[f64; 3]> {
        match self.role {
            Role::Pushed(force) => Some(force.map(|f| f / self.nodes.len() as f64)),
            Role::Held(_) | Role::Moved(_) => None,
        }
    }
}

/// Supports and loads of a mesh.
pub struct ByLabel {
    groups: Vec<Group>,
    held: Held,
    start: Vec<[f64; 3]>,
    forces: Option<Vec<[f64; 3]>>,
    /// Of a body that nothing holds.
    afloat: Option<Pieces>,
}

/// Part of the forces, or of their moments about the body, that may be left where they balance: decimal numbers are rounded.
const BALANCED: f64 = 1e-6;

fn roles(params: &SolveParams) -> Vec<(i32, Role)> {
    let held = params
        .held
        .iter()
        .map(|h| (h.label, Role::Held(h.components)));
    let moved = params.moved.iter().map(|m| (m.label, Role::Moved(m.by_mm)));
    let pushed = params
        .pushed
        .iter()
        .map(|p| (p.label, Role::Pushed(p.force_n)));
    held.chain(moved).chain(pushed).collect()
}

/// The labels that are moved or pushed: bone that touches none of them bears nothing.
pub fn loaded(params: &SolveParams) -> Vec<i32> {
    let all = roles(params).into_iter();
    let labels = all.filter(|(_, role)| !matches!(role, Role::Held(_)));
    labels.map(|(label, _)| label).collect()
}

impl ByLabel {
    /// The supports and loads of the settings.
    ///
    /// # Errors
    /// Labels that are not there or touch no bone that bears load, one node with two displacements, a rigid motion that is left free,
    /// forces that do not balance on a body that nothing holds.
    pub fn of(mesh: &VoxelMesh, map: &LabelMap, params: &SolveParams) -> Result<ByLabel> {
        let groups = groups(mesh, map, params)?;
        let mut held = Held::none(mesh.len());
        let mut start = vec![[0.0; 3]; mesh.len()];
        prescribe(&groups, &mut held, &mut start)?;
        let forces = forces(&groups, &held, mesh.len())?;
        let pieces = Pieces::of(mesh);
        let free = pieces.free(mesh, &held);
        let floats = !groups.iter().any(|g| !matches!(g.role, Role::Pushed(_)));
        match &forces {
            Some(forces) if floats => {
                refuse_unbalanced(mesh, &pieces, forces)?;
                pieces.stop(mesh, &free, &mut held);
            }
            _ => refuse_free(&pieces, &free)?,
        }
        Ok(ByLabel {
            groups,
            held,
            start,
            forces,
            afloat: floats.then_some(pieces),
        })
    }

    /// Adds what is held to `held`, which has the padding.
    pub fn hold(&self, mut held: Held) -> Held {
        held.0
            .iter_mut()
            .zip(&self.held.0)
            .for_each(|(all, own)| *all |= own);
        held
    }

    /// The prescribed displacements, 0 elsewhere.
    pub fn start(&self) -> Vec<[f64; 3]> {
        self.start.clone()
    }

    /// Forces on the nodes, N; None without.
    pub fn forces(&self) -> Option<&[[f64; 3]]> {
        self.forces.as_deref()
    }

    /// Takes rigid motions out of the displacements of a body that nothing holds.
    pub fn settle(&self, mesh: &VoxelMesh, u: &mut [[f64; 3]]) {
        if let Some(pieces) = &self.afloat {
            pieces.settle(mesh, u);
        }
    }

    fn drivers(&self) -> impl Iterator<Item = &Group> {
        self.groups.iter().filter(|g| g.role.drives())
    }

    /// Force and stiffness where one label is moved or pushed, along what is prescribed; neither of several.
    pub fn work(&self, info: &CgInfo) -> EndWork {
        let relative_error = info.energy_error / info.energy;
        let none = EndWork {
            relative_error,
            ..EndWork::default()
        };
        let mut drivers = self.drivers();
        let (Some(driver), None) = (drivers.next(), drivers.next()) else {
            return none;
        };
        match driver.role {
            Role::Held(_) => none,
            Role::Moved(by) => {
                let far = by.iter().flatten().map(|v| v * v).sum::<f64>().sqrt();
                EndWork::of_displacement(info.energy, far, relative_error)
            }
            Role::Pushed(force) => {
                let squared: f64 = force.iter().map(|f| f * f).sum();
                EndWork {
                    force_n: Some(squared.sqrt()),
                    stiffness_n_per_mm: Some(squared / info.energy),
                    ..none
                }
            }
        }
    }

    /// What a reader must know.
    pub fn note(&self) -> Option<String> {
        let mut notes = Vec::new();
        if self.drivers().count() > 1 {
            notes.push("several labels are moved or pushed: their forces and displacements are in labels.csv");
        }
        if self.afloat.is_some() {
            notes.push("no label is held: the forces balance, and the mean rigid motion is taken out of the displacements");
        }
        (!notes.is_empty()).then(|| notes.join("; "))
    }

    /// Forces, moments, mean displacements and work of each label, from displacements `u` (mm) and the nodal forces that they take (N).
    pub fn table(&self, mesh: &VoxelMesh, u: &[[f64; 3]], force: &[[f64; 3]]) -> Vec<LabelForces> {
        let own = |i: usize| line(&self.groups[i], mesh, u, &|node| self.force(i, node, force));
        (0..self.groups.len()).map(own).collect()
    }

    /// The part of a node's force that group `i` has: its own share of what pushes, or the reaction, which the first of the groups has that hold
    /// or move the node.
    fn force(&self, i: usize, node: usize, force: &[[f64; 3]]) -> [f64; 3] {
        let group = &self.groups[i];
        if let Some(share) = group.share() {
            return share;
        }
        let has = |g: &&Group| g.nodes.binary_search(&node).is_ok();
        if self.groups[..i]
            .iter()
            .filter(has)
            .any(|g| g.share().is_none())
        {
            return [0.0; 3];
        }
        let mut reaction = force[node];
        for share in self.groups.iter().filter(has).filter_map(Group::share) {
            (0..3).for_each(|a| reaction[a] -= share[a]);
        }
        reaction
    }
}

fn line(
    group: &Group,
    mesh: &VoxelMesh,
    u: &[[f64; 3]],
    force: &dyn Fn(usize) -> [f64; 3],
) -> LabelForces {
    let count = group.nodes.len() as f64;
    let mean = |of: &dyn Fn(usize) -> [f64; 3]| {
        let mut sum = [0.0; 3];
        for node in &group.nodes {
            let v = of(*node);
            (0..3).for_each(|a| sum[a] += v[a]);
        }
        sum.map(|v| v / count)
    };
    let about = mean(&|node| mesh.position(node));
    let moment = |node: usize| {
        let at = mesh.position(node);
        cross(std::array::from_fn(|a| at[a] - about[a]), force(node))
    };
    let [fx, fy, fz] = mean(force).map(|v| v * count);
    let [mx, my, mz] = mean(&moment).map(|v| v * count);
    let [ux, uy, uz] = mean(&|node| u[node]);
    let work = |node: &usize| {
        let (u, f) = (u[*node], force(*node));
        (0..3).map(|a| u[a] * f[a]).sum::<f64>()
    };
    LabelForces {
        label: group.label,
        role: group.role.name().to_owned(),
        nodes: group.nodes.len() as u64,
        force_x_n: fx,
        force_y_n: fy,
        force_z_n: fz,
        moment_x_nmm: mx,
        moment_y_nmm: my,
        moment_z_nmm: mz,
        about_x_mm: about[0],
        about_y_mm: about[1],
        about_z_mm: about[2],
        displacement_x_mm: ux,
        displacement_y_mm: uy,
        displacement_z_mm: uz,
        work_nmm: group.nodes.iter().map(work).sum(),
    }
}

/// The nodes of each label of the settings, in the settings' order.
fn groups(mesh: &VoxelMesh, map: &LabelMap, params: &SolveParams) -> Result<Vec<Group>> {
    let mut groups: Vec<Group> = roles(params)
        .into_iter()
        .map(|(label, role)| Group {
            label,
            role,
            nodes: Vec::new(),
        })
        .collect();
    for segment in &mesh.segments {
        let [x, y, z] = segment.at.map(|v| v as usize);
        for (i, node) in segment
            .nodes()
            .enumerate()
            .filter(|(_, n)| mesh.around[*n] != 0)
        {
            map.around([x + i, y, z], |label| {
                for group in groups.iter_mut().filter(|g| g.label == label) {
                    if group.nodes.last() != Some(&node) {
                        group.nodes.push(node);
                    }
                }
            });
        }
    }
    // A label that the image does not have is why others bear nothing.
    let all = map.all();
    let mut empty: Vec<&Group> = groups.iter().filter(|g| g.nodes.is_empty()).collect();
    empty.sort_by_key(|g| all.contains(&g.label));
    match empty.first() {
        Some(group) => Err(not_there(group, map)),
        None => Ok(groups),
    }
}

fn not_there(group: &Group, map: &LabelMap) -> Error {
    let (label, role, all) = (group.label, group.role.name(), map.all());
    let key = format!("solve.{role}");
    let (key, source) = (key.as_str(), map.source());
    if all.contains(&label) {
        return Error::setting(
            key,
            format!("no voxel of label {label} in {source} touches bone that bears load"),
            "labels act on the bone's nodes at the corners of their voxels: check the image, and that a label is moved or pushed on the same piece of bone",
        );
    }
    let names: Vec<String> = all.iter().map(i32::to_string).collect();
    let advice = match names.is_empty() {
        true => "the image has no labels at all: check the file".to_owned(),
        false => format!("name one of {}", names.join(", ")),
    };
    Error::setting(key, format!("{source} has no label {label}"), advice)
}

/// Puts what is prescribed into `held` and `start`.
fn prescribe(groups: &[Group], held: &mut Held, start: &mut [[f64; 3]]) -> Result<()> {
    for (i, group) in groups.iter().enumerate() {
        for c in 0..3 {
            let Some(value) = group.role.prescribed(c) else {
                continue;
            };
            let is_other = |n: &&usize| held.is_held(**n, c) && start[**n][c] != value;
            let conflicts = group.nodes.iter().filter(is_other).count();
            if conflicts > 0 {
                let touches = |g: &&Group| {
                    g.role.prescribed(c).is_some_and(|v| v != value)
                        && g.nodes.iter().any(|n| group.nodes.binary_search(n).is_ok())
                };
                let other = groups[..i].iter().find(touches);
                if other.is_some_and(|g| g.label == group.label) {
                    let axis = ["x", "y", "z"][c];
                    return Err(Error::setting(
                        format!("solve.{}", group.role.name()),
                        format!("label {} is both held and moved along {axis}", group.label),
                        "name the components that are held, as in --held 2:xy, or leave one of them out",
                    ));
                }
                return Err(Error::setting(
                    format!("solve.{}", group.role.name()),
                    format!(
                        "labels {} and {} share {conflicts} nodes, which would be displaced along {} by two values",
                        other.map_or(group.label, |g| g.label),
                        group.label,
                        ["x", "y", "z"][c]
                    ),
                    "leave a layer of voxels between labels that are held or moved differently",
                ));
            }
            for &node in &group.nodes {
                held.hold(node, c);
                start[node][c] = value;
            }
        }
    }
    Ok(())
}

/// Forces of the pushed labels, spread evenly over their nodes.
fn forces(groups: &[Group], held: &Held, count: usize) -> Result<Option<Vec<[f64; 3]>>> {
    let mut forces = None;
    for group in groups {
        let Role::Pushed(force) = group.role else {
            continue;
        };
        for c in (0..3).filter(|&c| force[c] != 0.0) {
            if group.nodes.iter().all(|&node| held.is_held(node, c)) {
                let axis = ["x", "y", "z"][c];
                return Err(Error::setting(
                    "solve.pushed",
                    format!(
                        "label {} is pushed along {axis}, where all its nodes are held",
                        group.label
                    ),
                    "a force on a support strains nothing: push another label, or leave that component free",
                ));
            }
        }
        let all = forces.get_or_insert_with(|| vec![[0.0; 3]; count]);
        let share = force.map(|f| f / group.nodes.len() as f64);
        for &node in &group.nodes {
            (0..3).for_each(|c| all[node][c] += share[c]);
        }
    }
    Ok(forces)
}

fn refuse_free(pieces: &Pieces, free: &[Vec<[f64; 6]>]) -> Result<()> {
    let Some(piece) = (0..free.len()).find(|&p| !free[p].is_empty()) else {
        return Ok(());
    };
    let frame = pieces.frame(piece);
    let words: Vec<String> = free[piece].iter().map(|m| frame.in_words(m)).collect();
    let [x, y, z] = frame.centre_mm.map(|v| (v * 1e3).round() / 1e3);
    let which = match pieces.all().count() {
        1 => "the bone".to_owned(),
        n => format!("one of {n} pieces of bone, about ({x}, {y}, {z}) mm,"),
    };
    Err(Error::setting(
        "solve.held",
        format!(
            "{which} can still move without strain: {}",
            words.join("; ")
        ),
        "hold more labels or more components (--held LABEL holds all three), or leave the loose piece out",
    ))
}

fn refuse_unbalanced(mesh: &VoxelMesh, pieces: &Pieces, forces: &[[f64; 3]]) -> Result<()> {
    let size = pieces.all().count();
    let mut sums: Vec<([f64; 3], [f64; 3], f64)> = Vec::new();
    super::pieces::each(mesh, |node, at| {
        let piece = pieces.at(node);
        if sums.len() <= piece {
            sums.resize(piece + 1, ([0.0; 3], [0.0; 3], 0.0));
        }
        let (force, moment, whole) = &mut sums[piece];
        let f = forces[node];
        let centre = pieces.frame(piece).centre_mm;
        let m = cross(std::array::from_fn(|a| at[a] - centre[a]), f);
        for a in 0..3 {
            force[a] += f[a];
            moment[a] += m[a];
        }
        *whole += f.iter().map(|v| v * v).sum::<f64>().sqrt();
    });
    for piece in pieces.all() {
        let (force, moment, whole) = sums[piece];
        let [f, m] = [force, moment].map(|v| v.iter().map(|v| v * v).sum::<f64>().sqrt());
        if f <= BALANCED * whole && m <= BALANCED * whole * pieces.frame(piece).size_mm {
            continue;
        }
        let said = |v: [f64; 3]| v.map(|v| format!("{v:.4}")).join(", ");
        let of = if size == 1 {
            ""
        } else {
            " on one of the pieces"
        };
        return Err(Error::setting(
            "solve.pushed",
            format!(
                "no label is held, and the forces do not balance{of}: they sum to ({}) N and, about its middle, ({}) N mm",
                said(force),
                said(moment)
            ),
            "hold a label (--held LABEL), or push labels so that forces and moments sum to zero",
        ));
    }
    Ok(())
}
