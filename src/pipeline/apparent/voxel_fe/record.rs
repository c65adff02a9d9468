//! Owns what of solved voxel elements is kept on request: fields on the scan's grid, and the failure load.

use crate::error::Result;
use crate::mask::resample;
use crate::measure::surface_energy::{Element, SurfaceEnergy, surface_energy};
use crate::physics::hex8::element::Integration;
use crate::physics::hex8::fields::{Brick, Kind, bricks, sample};
use crate::pipeline::apparent::discretisation::Prepared;
use crate::pipeline::apparent::fields::{Field, FieldVolume, Recorded};
use crate::pipeline::apparent::params::SolveParams;
use crate::pipeline::apparent::tissue::Tissue;
use crate::pipeline::apparent::voxel_fe::bricks::Bricks;
use crate::volume::{Specimen, Volume};

/// Fields and failure load of a solved model, as far as the settings ask for them.
pub fn record(
    model: &Bricks,
    prepared: Prepared,
    params: &SolveParams,
    u: &[[f64; 3]],
    reaction_n: f64,
) -> Result<Recorded> {
    let Prepared { specimen, tissue } = prepared;
    let surface = match tissue {
        Tissue::Uniform(s) => surface(
            model,
            &[(s.young_mpa, s.poisson, Integration::of(s.poisson))],
            u,
        ),
        Tissue::Mixed(_) => None,
    };
    if params.fields.is_empty() && params.pistoia.is_none() {
        return Ok(Recorded {
            surface,
            ..Recorded::default()
        });
    }
    let kinds: Vec<Kind> = match tissue {
        Tissue::Uniform(s) => vec![(s.young_mpa, s.poisson, Integration::of(s.poisson))],
        Tissue::Mixed(m) => {
            let kind = |&nu: &f64| (m.mean_mpa, nu, Integration::of(nu));
            m.poissons.iter().map(kind).collect()
        }
    };
    let elements = bricks(model.mesh(), &kinds, |node| model.stiffness_of(node), u);
    let fractions = (params.coarsen > 1).then(|| resample::coarsen(&specimen.bone, params.coarsen));
    let fraction = |e: usize| fractions.as_ref().map_or(1.0, |f| f.as_slice()[e]);
    let failure = params.pistoia.and_then(|criterion| {
        let strain = |b: &Brick| (b.effective_strain, fraction(b.element));
        criterion.failure(elements.iter().map(strain).collect(), reaction_n)
    });
    let on_scan = |name, value: &dyn Fn(&Brick) -> f32| FieldVolume {
        name,
        values: spread(model, specimen, params, &elements, value),
    };
    let mut fields = Vec::new();
    for field in &params.fields {
        match field {
            Field::Sed => fields.push(on_scan("sed_mpa", &|b| b.energy_density_mpa)),
            Field::VonMises => fields.push(on_scan("von_mises_mpa", &|b| b.von_mises_mpa)),
            Field::Fraction => fields.push(on_scan("fraction", &|b| fraction(b.element))),
            Field::Displacement => {
                for (a, name) in [
                    "displacement_x_mm",
                    "displacement_y_mm",
                    "displacement_z_mm",
                ]
                .into_iter()
                .enumerate()
                {
                    fields.push(on_scan(name, &|b| b.displacement_mm[a]));
                }
            }
        }
    }
    Ok(Recorded {
        fields,
        failure,
        surface,
        note: None,
        sites: None,
    })
}

/// Elements that means of the surface's energy are taken over, about.
const SAMPLED: usize = 200_000;

/// How the modulus answers to the surface, from a sample of a solved model's elements.
fn surface(model: &Bricks, kinds: &[Kind], u: &[[f64; 3]]) -> Option<SurfaceEnergy> {
    let mesh = model.mesh();
    let step = mesh.elements.div_ceil(SAMPLED);
    let sampled = sample(mesh, kinds, |node| model.stiffness_of(node), u, step);
    let mut filled = vec![false; mesh.grid.len()];
    mesh.low_corner_elements()
        .flatten()
        .for_each(|element| filled[element] = true);
    let [nx, ny, nz] = mesh.grid.n;
    let free_faces = |e: usize| {
        let at = [e % nx, e / nx % ny, e / (nx * ny)];
        let beside = [(0, 1, nx), (1, nx, ny), (2, nx * ny, nz)];
        let free = |(axis, stride, n): (usize, usize, usize)| {
            let low = at[axis] > 0 && !filled[e - stride];
            let high = at[axis] + 1 < n && !filled[e + stride];
            usize::from(low) + usize::from(high)
        };
        beside.into_iter().map(free).sum()
    };
    surface_energy(sampled.iter().map(|brick| Element {
        energy_density_mpa: f64::from(brick.energy_density_mpa),
        free_faces: free_faces(brick.element),
    }))
}

/// The same on the scan's grid, from elements of another size: the mean of a voxel's elements where they are finer, that
/// of the element around the voxel's centre where they are coarser.
pub fn onto(recorded: Recorded, scan: &Volume<u8>) -> Recorded {
    let fields = recorded.fields.into_iter().map(|field| FieldVolume {
        name: field.name,
        values: volume_onto(&field.values, scan),
    });
    Recorded {
        fields: fields.collect(),
        ..recorded
    }
}

fn volume_onto(values: &Volume<f32>, scan: &Volume<u8>) -> Volume<f32> {
    let (from, to) = (values.grid, scan.grid);
    let mut out = vec![0f32; to.len()];
    if from.n[0] >= to.n[0] {
        let [fx, fy, _] = from.n;
        let factor: [usize; 3] = std::array::from_fn(|a| from.n[a] / to.n[a]);
        let share = 1.0 / factor.iter().product::<usize>() as f32;
        for (e, value) in values.as_slice().iter().enumerate() {
            let at = [
                e % fx / factor[0],
                e / fx % fy / factor[1],
                e / (fx * fy) / factor[2],
            ];
            out[to.index(at)] += share * value;
        }
    } else {
        let around = |i: usize, a: usize| ((2 * i + 1) * from.n[a]) / (2 * to.n[a]);
        let [sx, sy, _] = to.n;
        for (v, out) in out
            .iter_mut()
            .enumerate()
            .filter(|(v, _)| scan.as_slice()[*v] != 0)
        {
            let at = [v % sx, v / sx % sy, v / (sx * sy)];
            *out = values.as_slice()[from.index([0, 1, 2].map(|a| around(at[a], a)))];
        }
    }
    let mut volume = Volume::from_vec(to, out);
    volume.affine = scan.affine;
    volume
}

/// Elements' values by voxel of the scan: the mean of a voxel's elements, or that of the element around its centre.
fn spread(
    model: &Bricks,
    specimen: &Specimen,
    params: &SolveParams,
    elements: &[Brick],
    value: &dyn Fn(&Brick) -> f32,
) -> Volume<f32> {
    let (scan, grid) = (specimen.bone.grid, model.mesh().grid);
    let mut out = vec![0f32; scan.len()];
    let [nx, ny, _] = grid.n;
    if params.coarsen > 1 {
        let mut coarse = vec![0f32; grid.len()];
        elements.iter().for_each(|b| coarse[b.element] = value(b));
        let around = |i: usize, a: usize| ((2 * i + 1) * grid.n[a]) / (2 * scan.n[a]);
        let [sx, sy, _] = scan.n;
        for (v, out) in out.iter_mut().enumerate() {
            if specimen.bone.as_slice()[v] != 0 {
                let at = [v % sx, v / sx % sy, v / (sx * sy)];
                *out = coarse[grid.index([0, 1, 2].map(|a| around(at[a], a)))];
            }
        }
    } else {
        let n = params.refine;
        let share = 1.0 / (n * n * n) as f32;
        for b in elements {
            let e = b.element;
            let voxel = scan.index([e % nx / n, e / nx % ny / n, e / (nx * ny) / n]);
            out[voxel] += share * value(b);
        }
    }
    let mut volume = Volume::from_vec(scan, out);
    volume.affine = specimen.bone.affine;
    volume
}
