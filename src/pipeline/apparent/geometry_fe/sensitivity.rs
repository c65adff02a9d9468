//! Owns how a modulus answers to the threshold: the energy density at the surface, weighted by how far a change of grey value
//! moves it there.
//!
//! Under prescribed displacements a surface that moves out by `1/|∇g|` adds `∫ w/|∇g|` of energy and `∫ 1/|∇g|` of volume to first
//! order, `w` the energy density and `g` the grey value, so `dE/E = (w_surface / w_mean) dBV/BV` with that weighted mean.

use crate::discretisation::tetrahedra::mesh::{cross, dot, minus};
use crate::discretisation::tetrahedra::pieces::{FACES, Faces};
use crate::discretisation::tetrahedra::surface::Surface;
use crate::measure::surface_energy::SurfaceEnergy;
use crate::physics::tet10::Tet10;
use crate::physics::tet10::strain::within;
use rayon::prelude::*;

/// Part of the mean slope below which a grey value's is not taken for smaller: there the surface is about to vanish or to merge,
/// and no first order holds.
const LEAST_SLOPE: f64 = 0.1;

/// Places on a face whose mean is exact for quadratic functions.
const PLACES: [[f64; 3]; 3] = [
    [2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0],
    [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0],
    [1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0],
];

/// One place of the free surface: its share of the area, the energy density, the slope of the grey value per mm.
struct Sample {
    area: f64,
    density: f64,
    slope: f64,
}

/// Of a solved model whose free surface is that of `surface`; `is_grey`: its values are those of an image, else the surface moves
/// by one length everywhere. None without a free surface.
pub fn of(
    model: &Tet10,
    surface: &Surface,
    is_grey: bool,
    u: &[[f64; 3]],
) -> Option<SurfaceEnergy> {
    let mesh = &model.mesh;
    let corners: Vec<[u32; 4]> = mesh
        .elements
        .iter()
        .map(|e| [e[0], e[1], e[2], e[3]])
        .collect();
    let free = Faces::of(&corners).free;
    let sampled = |face: &u32| {
        let (e, across) = (*face as usize / 4, *face as usize % 4);
        let at = FACES[across].map(|c| mesh.nodes_mm[mesh.elements[e][c] as usize]);
        let on = at.map(|p| mesh.faces_at(p));
        let cut = (0..3).any(|a| on[0][a] & on[1][a] & on[2][a] != 0);
        let area = dot_self(cross(minus(at[1], at[0]), minus(at[2], at[0]))).sqrt() / 2.0;
        let strains = (!cut).then(|| model.strains(e, u));
        strains.into_iter().flat_map(move |strains| {
            PLACES.map(|place| {
                let mut inside = [0.0; 4];
                FACES[across]
                    .iter()
                    .zip(place)
                    .for_each(|(c, p)| inside[*c] = p);
                let p = [0, 1, 2].map(|c| (0..3).map(|k| place[k] * at[k][c]).sum());
                let slope = match is_grey {
                    true => dot_self(surface.value_and_slope(p).1).sqrt(),
                    false => 1.0,
                };
                Sample {
                    area: area / 3.0,
                    density: model.density_mpa(e, &within(&strains, inside)),
                    slope,
                }
            })
        })
    };
    let samples: Vec<Sample> = free.par_iter().flat_map_iter(sampled).collect();
    let area: f64 = samples.iter().map(|s| s.area).sum();
    let mean_slope = samples.iter().map(|s| s.area * s.slope).sum::<f64>() / area;
    let weight = |s: &Sample| s.area / s.slope.max(LEAST_SLOPE * mean_slope);
    let weights: f64 = samples.iter().map(weight).sum();
    let at_surface = samples.iter().map(|s| weight(s) * s.density).sum::<f64>() / weights;
    let of_element = |e: usize| {
        let volume = model.volume_mm3(e);
        let density = model.mean_density_mpa(e, &model.strains(e, u));
        [volume, volume * density, volume * density * density]
    };
    let elements: Vec<[f64; 3]> = (0..mesh.elements.len())
        .into_par_iter()
        .map(of_element)
        .collect();
    let [volume, energy, squares] = [0, 1, 2].map(|k| elements.iter().map(|e| e[k]).sum::<f64>());
    let mean = energy / volume;
    (mean > 0.0 && weights > 0.0).then(|| SurfaceEnergy {
        sensitivity: at_surface / mean,
        ratio: at_surface / mean,
        spread: squares / volume / (mean * mean),
    })
}

fn dot_self(v: [f64; 3]) -> f64 {
    dot(v, v)
}
