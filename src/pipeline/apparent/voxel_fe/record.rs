//! Owns what of solved voxel elements is kept on request: fields on the scan's grid, and the failure load.

use crate::error::Result;
use crate::mask::resample;
use crate::physics::hex8::fields::{Brick, Kind, bricks};
use crate::pipeline::apparent::discretisation::Prepared;
use crate::pipeline::apparent::fields::{Field, FieldVolume, Recorded};
use crate::pipeline::apparent::params::SolveParams;
use crate::pipeline::apparent::tissue::Tissue;
use crate::pipeline::apparent::voxel_fe::bricks::{Bricks, rule};
use crate::volume::{Specimen, Volume};

/// Fields and failure load of a solved model, as far as the settings ask for them.
pub fn record(
    model: &Bricks,
    prepared: Prepared,
    params: &SolveParams,
    u: &[[f64; 3]],
    reaction_n: f64,
) -> Result<Recorded> {
    if params.fields.is_empty() && params.pistoia.is_none() {
        return Ok(Recorded::default());
    }
    let Prepared { specimen, tissue } = prepared;
    let kinds: Vec<Kind> = match tissue {
        Tissue::Uniform(s) => vec![(s.young_mpa, s.poisson, rule(s.poisson))],
        Tissue::Mixed(m) => {
            let kind = |&nu: &f64| (m.mean_mpa, nu, rule(nu));
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
        sites: None,
    })
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
