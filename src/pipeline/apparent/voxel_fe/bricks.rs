//! Owns the voxel elements of a specimen: their size, homogeneous or heterogeneous, and how they are integrated.

use crate::discretisation::voxels::{Planes, VoxelMesh};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::mask::resample;
use crate::operator::Operator;
use crate::operator::coarsen::{Block, Coarsen, VisitRow};
use crate::physics::hex8::Hex8;
use crate::physics::hex8::element::Integration;
use crate::physics::hex8::heterogeneous::Heterogeneous;
use crate::pipeline::apparent::discretisation::Prepared;
use crate::pipeline::apparent::ends::label_image::LabelMap;
use crate::pipeline::apparent::ends::uneven::Uneven;
use crate::pipeline::apparent::params::{Load, SolveParams};
use crate::pipeline::apparent::tissue::{Mixed, Tissue};
use crate::volume::Specimen;
use std::ops::Range;

/// Bone fraction of a coarsened voxel below which it is no element. A choice, as for weighted sites of lattices.
pub(super) const LEAST_FRACTION: f32 = 0.02;

/// Which elements carry load.
#[derive(Clone, Copy)]
pub enum Keep<'a> {
    /// Those joined to both grips.
    BetweenGrips,
    /// Those joined to a face of the volume.
    AtFaces,
    /// Those joined to these labels.
    AtLabels(&'a LabelMap<'a>, &'a [i32]),
    /// Those joined to what is seen of both ends.
    Between(&'a Uneven),
}

impl Keep<'_> {
    /// Those that a load between ends, or on faces, needs.
    pub fn under(load: Load) -> Keep<'static> {
        match load.motion() {
            None => Keep::AtFaces,
            Some(_) => Keep::BetweenGrips,
        }
    }
}

/// One brick per voxel, or finer or coarser ones.
// One is made a solve: its size on the stack does not matter.
#[allow(clippy::large_enum_variant)]
pub enum Bricks {
    /// All elements are alike.
    Homogeneous(Hex8),
    /// A factor, and a kind, for each element.
    Heterogeneous(Heterogeneous),
}

impl Bricks {
    /// # Errors
    /// Grips that meet, too many nodes, or voxels far from cubes.
    pub fn new(prepared: Prepared, params: &SolveParams, keep: Keep<'_>) -> Result<Self> {
        let Prepared { specimen, tissue } = prepared;
        refuse_long_voxels(specimen.bone.grid)?;
        let solid = match tissue {
            Tissue::Uniform(solid) => solid,
            Tissue::Mixed(mixed) => {
                return Ok(Bricks::Heterogeneous(of_mixed(
                    specimen, mixed, params, keep,
                )?));
            }
        };
        let (young, nu) = (solid.young_mpa, solid.poisson);
        let rule = rule(params, nu);
        if params.coarsen > 1 {
            let fractions = resample::coarsen(&specimen.bone, params.coarsen);
            let values = fractions.as_slice();
            let bone = |f: &f32| *f >= LEAST_FRACTION;
            let mesh = mesh(fractions.grid, values, bone, params, keep)?;
            let heterogeneous = Heterogeneous::new(mesh, young, nu, rule, |e| values[e]);
            return Ok(Bricks::Heterogeneous(heterogeneous));
        }
        let mesh = whole_mesh(specimen, params, keep)?;
        Ok(Bricks::Homogeneous(Hex8::new(mesh, young, nu, rule)))
    }

    /// Factor and kind of the element whose corner of smallest x, y, z is a node.
    pub fn stiffness_of(&self, node: usize) -> (f32, u8) {
        match self {
            Bricks::Homogeneous(_) => (1.0, 0),
            Bricks::Heterogeneous(model) => model.stiffness_of(node),
        }
    }

    /// The elements and their nodes.
    pub fn mesh(&self) -> &VoxelMesh {
        match self {
            Bricks::Homogeneous(model) => &model.mesh,
            Bricks::Heterogeneous(model) => model.mesh(),
        }
    }
}

/// How elements are integrated: those that may yield by mean dilatation, since plastic flow keeps the volume, in every state.
pub(super) fn rule(params: &SolveParams, poisson: f64) -> Integration {
    match params.plasticity {
        Some(_) => Integration::MeanDilatation,
        None => Integration::of(poisson),
    }
}

/// One element per voxel, or finer ones.
///
/// # Errors
/// Grips that meet, or too many nodes.
pub fn whole_mesh(specimen: &Specimen, params: &SolveParams, keep: Keep<'_>) -> Result<VoxelMesh> {
    let refined = (params.refine > 1).then(|| resample::refine(&specimen.bone, params.refine));
    let bone = refined.as_ref().unwrap_or(&specimen.bone);
    mesh(bone.grid, bone.as_slice(), |b| *b != 0, params, keep)
}

/// Edges of an element may differ by this factor. The preconditioner coarsens all axes alike: iterations grow with the square of
/// the factor (40³ elements: 16 to 1 takes a second, 100 to 1 does not end in minutes).
const MOST_LONG: f64 = 20.0;

fn refuse_long_voxels(grid: Grid) -> Result<()> {
    let edges = grid.spacing_mm.into_iter();
    let [least, largest] = [f64::min, f64::max].map(|f| edges.clone().reduce(f).unwrap_or(1.0));
    if largest <= MOST_LONG * least {
        return Ok(());
    }
    let [x, y, z] = grid.spacing_mm;
    Err(Error::specimen(
        format!(
            "voxels of {x} × {y} × {z} mm are {:.0} times as long as wide: elements of this shape resolve no strut, and their solve does not end in reasonable time (at most {MOST_LONG} times)",
            largest / least
        ),
        "check the voxel size (segment --spacing), or make cubes: segment --resample MM",
    ))
}

/// Elements of tissue that differs from voxel to voxel.
fn of_mixed(
    specimen: &Specimen,
    mixed: &Mixed,
    params: &SolveParams,
    keep: Keep<'_>,
) -> Result<Heterogeneous> {
    let kinds: Vec<(f64, Integration)> = mixed
        .poissons
        .iter()
        .map(|&nu| (nu, rule(params, nu)))
        .collect();
    let young = mixed.mean_mpa;
    if params.coarsen > 1 {
        if kinds.len() > 1 {
            return Err(Error::setting(
                "coarsen",
                "tissues of different Poisson's ratios would share elements",
                "solve at full resolution, or give all labels one Poisson's ratio",
            ));
        }
        let fractions = resample::coarsen(&specimen.bone, params.coarsen);
        let moduli = resample::coarsen_values(&specimen.bone, params.coarsen, &mixed.factor);
        let bone = |f: &f32| *f >= LEAST_FRACTION;
        let mesh = mesh(fractions.grid, fractions.as_slice(), bone, params, keep)?;
        let factor = |e: usize| moduli.as_slice()[e];
        return Ok(Heterogeneous::of_kinds(mesh, young, &kinds, factor, |_| 0));
    }
    let n = params.refine;
    let refined = (n > 1).then(|| resample::refine(&specimen.bone, n));
    let bone = refined.as_ref().unwrap_or(&specimen.bone);
    let mesh = mesh(bone.grid, bone.as_slice(), |b| *b != 0, params, keep)?;
    let (voxels, [nx, ny, _]) = (specimen.bone.grid, bone.grid.n);
    let voxel = |e: usize| match n {
        1 => e,
        _ => voxels.index([e % nx / n, e / nx % ny / n, e / (nx * ny) / n]),
    };
    let factor = |e: usize| mixed.factor[voxel(e)];
    let kind = |e: usize| mixed.kind.get(voxel(e)).copied().unwrap_or(0);
    Ok(Heterogeneous::of_kinds(mesh, young, &kinds, factor, kind))
}

fn mesh<T: Sync>(
    grid: Grid,
    voxels: &[T],
    is_bone: impl Fn(&T) -> bool + Sync,
    params: &SolveParams,
    keep: Keep<'_>,
) -> Result<VoxelMesh> {
    match keep {
        Keep::BetweenGrips => {
            let grips = Planes::within(&grid, params.axis, params.grip_mm)?;
            VoxelMesh::new(grid, voxels, is_bone, grips)
        }
        Keep::AtFaces => VoxelMesh::at_faces(grid, voxels, is_bone),
        Keep::AtLabels(map, labels) => {
            let touches = |run, y, z| map.touches(run, y, z, labels);
            VoxelMesh::joining(grid, voxels, is_bone, touches, touches)
        }
        Keep::Between(uneven) => uneven.mesh(grid, voxels, is_bone),
    }
}

impl Operator<3> for Bricks {
    fn sites(&self) -> usize {
        self.mesh().len()
    }

    fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        match self {
            Bricks::Homogeneous(model) => model.apply(x, y),
            Bricks::Heterogeneous(model) => model.apply(x, y),
        }
    }

    fn diagonal(&self, d: &mut [[f64; 3]]) {
        match self {
            Bricks::Homogeneous(model) => model.diagonal(d),
            Bricks::Heterogeneous(model) => model.diagonal(d),
        }
    }
}

impl Coarsen for Bricks {
    fn positions(&self, sites: Range<usize>, x: &mut [[f64; 3]]) {
        match self {
            Bricks::Homogeneous(model) => model.positions(sites, x),
            Bricks::Heterogeneous(model) => model.positions(sites, x),
        }
    }

    fn each_row(&self, sites: Range<usize>, visit: &mut VisitRow<Block>) {
        match self {
            Bricks::Homogeneous(model) => model.each_row(sites, visit),
            Bricks::Heterogeneous(model) => model.each_row(sites, visit),
        }
    }

    fn each_diagonal(&self, sites: Range<usize>, visit: &mut dyn FnMut(usize, &Block)) {
        match self {
            Bricks::Homogeneous(model) => model.each_diagonal(sites, visit),
            Bricks::Heterogeneous(model) => model.each_diagonal(sites, visit),
        }
    }

    fn reach(&self, sites: Range<usize>) -> Range<usize> {
        self.mesh().reach(sites)
    }

    fn hinges(&self, sites: Range<usize>, hinges: &mut [bool]) {
        match self {
            Bricks::Homogeneous(model) => model.hinges(sites, hinges),
            Bricks::Heterogeneous(model) => model.hinges(sites, hinges),
        }
    }

    fn is_uniform(&self) -> bool {
        match self {
            Bricks::Homogeneous(model) => model.is_uniform(),
            Bricks::Heterogeneous(model) => model.is_uniform(),
        }
    }

    fn chunk(&self) -> usize {
        match self {
            Bricks::Homogeneous(model) => model.chunk(),
            Bricks::Heterogeneous(model) => model.chunk(),
        }
    }

    fn rows_f64(&self, sites: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        match self {
            Bricks::Homogeneous(model) => model.rows_f64(sites, x, y),
            Bricks::Heterogeneous(model) => model.rows_f64(sites, x, y),
        }
    }

    fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
        match self {
            Bricks::Homogeneous(model) => model.rows_f32(sites, x, y),
            Bricks::Heterogeneous(model) => model.rows_f32(sites, x, y),
        }
    }

    fn eigenvalue_bound(&self) -> f64 {
        match self {
            Bricks::Homogeneous(model) => model.eigenvalue_bound(),
            Bricks::Heterogeneous(model) => model.eigenvalue_bound(),
        }
    }
}
