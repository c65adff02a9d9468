//! Owns what of solved voxel elements is kept on request: fields on the scan's grid, the failure load, tissue by label.

use crate::grid::Grid;
use crate::mask::resample;
use crate::measure::apparent::EndWork;
use crate::measure::surface_energy::{Element, SurfaceEnergy, surface_energy};
use crate::physics::hex8::element;
use crate::physics::hex8::fields::{Brick, Deformed, Kind};
use crate::physics::hex8::flips::Solved;
use crate::pipeline::apparent::discretisation::Prepared;
use crate::pipeline::apparent::ends::supports::held;
use crate::pipeline::apparent::fields::{Equilibrated, Field, FieldVolume, Place, Recorded};
use crate::pipeline::apparent::params::{Load, Sed, SolveParams};
use crate::pipeline::apparent::tissue::Tissue;
use crate::pipeline::apparent::voxel_fe::bricks::Bricks;
use crate::pipeline::apparent::voxel_fe::bricks::rule;
use crate::pipeline::apparent::voxel_fe::principal::principal_fields;
use crate::pipeline::apparent::voxel_fe::sections::{ALL, sections};
use crate::pipeline::apparent::voxel_fe::spread::{onto, spread};
use crate::pipeline::apparent::voxel_fe::tissue_spread::{density, effective_strain};
use crate::pipeline::apparent::voxel_fe::{VoxelModel, failure, threshold, tissue_spread};
use crate::result::details::{Details, FailureAt};
use crate::volume::{Specimen, Volume};

/// Components of tensors, in the program's order.
const TENSOR: &[&str] = &["xx", "yy", "zz", "yz", "xz", "xy"];
const AXES: &[&str] = &["x", "y", "z"];

/// Elements that means of the surface's energy are taken over, about.
const SAMPLED: usize = 200_000;

/// A solved model, to be read as the settings ask.
pub struct Recorder<'a> {
    model: &'a VoxelModel,
    specimen: &'a Specimen,
    params: &'a SolveParams,
    solved: &'a Equilibrated<'a>,
    work: &'a EndWork,
    kinds: Vec<Kind>,
    is_uniform: bool,
    /// Bone fractions of coarser elements.
    fractions: Option<Volume<f32>>,
}

impl<'a> Recorder<'a> {
    pub fn new(
        model: &'a VoxelModel,
        Prepared { specimen, tissue }: Prepared<'a>,
        params: &'a SolveParams,
        solved: &'a Equilibrated<'a>,
        work: &'a EndWork,
    ) -> Self {
        let kinds = match tissue {
            Tissue::Uniform(s) => vec![(s.young_mpa, s.poisson, rule(params, s.poisson))],
            Tissue::Mixed(m) => {
                let kind = |&nu: &f64| (m.mean_mpa, nu, rule(params, nu));
                m.poissons.iter().map(kind).collect()
            }
        };
        let is_asked = !params.fields.is_empty() || params.pistoia.is_some() || params.statistics;
        Recorder {
            model,
            specimen,
            params,
            solved,
            work,
            kinds,
            is_uniform: matches!(tissue, Tissue::Uniform(_)),
            fractions: (is_asked && params.coarsen > 1)
                .then(|| resample::coarsen(&specimen.bone, params.coarsen)),
        }
    }

    /// Fields and numbers, as far as the settings ask for them; fields on the grid of `scan` where the elements are of another.
    pub fn record(&self, scan: Option<&Volume<u8>>) -> Recorded {
        let table = self.failures();
        Recorded {
            fields: self.fields(scan),
            failure: failure::chosen(&table, self.params),
            surface: (self.is_uniform && self.solved.plastic.is_none() && !self.by_label())
                .then(|| self.surface())
                .flatten(),
            note: None,
            euler: None,
            sites: None,
            mesh: None,
            details: Details {
                failure: table,
                ..self.statistics()
            },
        }
    }

    fn deformed(&self) -> Deformed<'_, impl Fn(usize) -> (f32, u8) + Sync> {
        let bricks = &self.model.bricks;
        Deformed {
            mesh: bricks.mesh(),
            kinds: &self.kinds,
            stiffness: move |node| bricks.stiffness_of(node),
            u: self.solved.u,
        }
    }

    /// Whether there are no ends whose modulus answers to the surface.
    fn by_label(&self) -> bool {
        self.params.load == Load::Labels
    }

    fn fraction(&self, element: usize) -> f32 {
        self.fractions
            .as_ref()
            .map_or(1.0, |f| f.as_slice()[element])
    }

    /// Label of an element, which is one voxel or a part of one.
    fn label(&self, element: usize) -> Option<i32> {
        let labels = self.model.labels.as_ref()?;
        let ([nx, ny, _], n) = (self.model.bricks.mesh().grid.n, self.params.refine);
        let (x, y, z) = (element % nx, element / nx % ny, element / (nx * ny));
        Some(labels.at(self.specimen.bone.grid.index([x / n, y / n, z / n])))
    }

    fn failures(&self) -> Vec<FailureAt> {
        let Some(criterion) = self.params.pistoia else {
            return Vec::new();
        };
        let (params, chosen) = (self.params, &self.params.failure_labels);
        let counts = |label: Option<i32>| {
            chosen.is_empty() || label.is_some_and(|label| chosen.contains(&label))
        };
        let strains = self.deformed().bricks(|b| {
            counts(self.label(b.element))
                .then(|| (effective_strain(b, params.sed), self.fraction(b.element)))
        });
        let failures = criterion.failures(strains.into_iter().flatten().collect());
        let at = |f| failure::at(f, params, &self.model.motion, self.work);
        failures.iter().map(at).collect()
    }

    fn statistics(&self) -> Details {
        if !self.params.statistics {
            return Details::default();
        }
        let deformed = self.deformed();
        let labels = self.model.labels.as_ref();
        let several = labels.map_or(&[][..], |labels| labels.several());
        let name = |e: usize| match self.label(e).filter(|_| !several.is_empty()) {
            Some(label) => label.to_string(),
            None => ALL.to_owned(),
        };
        Details {
            sections: sections(&deformed, self.model.grips, &self.model.motion, &name),
            tissue: tissue_spread::spread(
                &deformed,
                self.params.sed,
                several,
                &|e| self.label(e),
                &|e| self.fraction(e),
            ),
            ..Details::default()
        }
    }

    /// How the modulus answers to the surface, from a sample of the elements.
    fn surface(&self) -> Option<SurfaceEnergy> {
        let mesh = self.model.bricks.mesh();
        let step = mesh.elements.div_ceil(SAMPLED);
        let energies = |b: &Brick| (b.element, b.mean_energy_density_mpa);
        let sampled = self.deformed().sample(step, energies);
        let sum: f64 = sampled.iter().map(|(_, w)| f64::from(*w)).sum();
        let mean_mpa = sum / sampled.len().max(1) as f64;
        let mut filled = vec![false; mesh.grid.len()];
        mesh.low_corner_elements()
            .flatten()
            .for_each(|element| filled[element] = true);
        let [nx, ny, nz] = mesh.grid.n;
        let free_faces = |e: usize| {
            let at = [e % nx, e / nx % ny, e / (nx * ny)];
            let neighbours = [(0, 1, nx), (1, nx, ny), (2, nx * ny, nz)];
            let free = |(axis, stride, n): (usize, usize, usize)| {
                let low = at[axis] > 0 && !filled[e - stride];
                let high = at[axis] + 1 < n && !filled[e + stride];
                usize::from(low) + usize::from(high)
            };
            neighbours.into_iter().map(free).sum()
        };
        let of_density = surface_energy(sampled.into_iter().map(|(element, density)| Element {
            energy_density_mpa: f64::from(density),
            free_faces: free_faces(element),
        }))?;
        let of_flips = match *self.model.bricks {
            // New nodes on uneven ends would have to move with them.
            Bricks::Homogeneous(_) if self.params.ends_depth_mm > 0.0 => None,
            Bricks::Homogeneous(_) => self.flipped(mean_mpa),
            Bricks::Heterogeneous(_) => None,
        };
        Some(SurfaceEnergy {
            sensitivity: of_flips.unwrap_or(of_density.sensitivity),
            ..of_density
        })
    }

    /// How the modulus answers to voxels that change sides; of bricks that are alike.
    fn flipped(&self, mean_mpa: f64) -> Option<f64> {
        let (mesh, grips) = (self.model.bricks.mesh(), self.model.grips);
        let (young_mpa, poisson, rule) = self.kinds[0];
        let h = mesh.grid.spacing_mm;
        let solved = Solved {
            mesh,
            stiffness: &element::stiffness(h, young_mpa, poisson, rule),
            held: &held(&self.model.gripped(), &self.model.motion, self.params.load),
            u: self.solved.u,
        };
        let mean = mean_mpa * h.iter().product::<f64>();
        threshold::sensitivity(&solved, self.specimen, grips, mean)
    }

    fn fields(&self, scan: Option<&Volume<u8>>) -> Vec<FieldVolume> {
        let fields = self.params.fields.iter();
        fields.flat_map(|field| self.field(*field, scan)).collect()
    }

    fn field(&self, field: Field, scan: Option<&Volume<u8>>) -> Vec<FieldVolume> {
        let sed = self.params.sed;
        let scalar = |name, about: String, value: &(dyn Fn(&Brick) -> f32 + Sync)| {
            vec![one(name, self.on_voxels(scan, |b| [value(b)]), &[], about)]
        };
        let at_centres = |words: &str| format!("{words} at element centres");
        let order = "xx, yy, zz, yz, xz, xy at element centres";
        match field {
            Field::Displacement => {
                let components = self.on_voxels(scan, |b| b.displacement_mm);
                let names = components.into_iter().zip(AXES).map(|(component, axis)| {
                    let about = format!("displacement along {axis} in mm at element centres");
                    one(
                        &format!("displacement_{axis}_mm"),
                        vec![component],
                        &[],
                        about,
                    )
                });
                names.collect()
            }
            Field::Sed => scalar("sed_mpa", about_sed(sed), &|b| density(b, sed)),
            Field::VonMises => scalar(
                "von_mises_mpa",
                at_centres("von Mises stress, MPa,"),
                &|b| b.von_mises_mpa,
            ),
            Field::EffectiveStrain => scalar(
                "effective_strain",
                format!("sqrt(2 SED/E), SED {}", sed.in_words()),
                &|b| effective_strain(b, sed),
            ),
            Field::Fraction => scalar("fraction", "bone fraction of elements".into(), &|b| {
                self.fraction(b.element)
            }),
            Field::Strain => {
                let about = format!("{order}; shears are engineering shears");
                vec![one(
                    "strain",
                    self.on_voxels(scan, |b| b.strain),
                    TENSOR,
                    about,
                )]
            }
            Field::Stress => {
                let stress = self.on_voxels(scan, |b| b.stress_mpa);
                vec![one("stress_mpa", stress, TENSOR, format!("MPa, {order}"))]
            }
            Field::PrincipalStrain => {
                let strain = self.on_voxels(scan, |b| b.strain);
                principal_fields(&strain, 0.5, "principal_strain", "")
            }
            Field::PrincipalStress => {
                let stress = self.on_voxels(scan, |b| b.stress_mpa);
                principal_fields(&stress, 1.0, "principal_stress", "_mpa")
            }
            Field::NodalForce => vec![self.nodal_force()],
            Field::PlasticStrain => vec![self.plastic_strain(scan)],
        }
    }

    /// Values of the elements by voxel of the scan.
    fn on_voxels<const N: usize>(
        &self,
        scan: Option<&Volume<u8>>,
        read: impl Fn(&Brick) -> [f32; N] + Sync,
    ) -> Vec<Volume<f32>> {
        let grid = self.model.bricks.mesh().grid;
        let values = self.deformed().bricks(|b| (b.element, read(b)));
        let component = |i: usize| {
            let own = values.iter().map(|(element, v)| (*element, v[i]));
            let volume = spread(grid, self.specimen, self.params, own);
            scan.map_or_else(|| volume.clone(), |scan| onto(&volume, scan))
        };
        (0..N).map(component).collect()
    }

    /// Means over the elements.
    fn plastic_strain(&self, scan: Option<&Volume<u8>>) -> FieldVolume {
        let strains = self.solved.plastic.unwrap_or_default();
        let value = |element: usize| {
            let at = strains.binary_search_by_key(&element, |(e, _)| *e);
            at.map_or(0.0, |at| strains[at].1)
        };
        let values = self.on_voxels(scan, |b| [value(b.element)]);
        let about = "equivalent plastic strain, sqrt(2/3 e:e), means of elements".to_owned();
        one("plastic_strain", values, &[], about)
    }

    /// Forces of the supports at the corners of the voxels.
    fn nodal_force(&self) -> FieldVolume {
        let (mesh, bone) = (self.model.bricks.mesh(), &self.specimen.bone);
        let nodes = Grid::new(mesh.grid.n.map(|n| n + 1), mesh.grid.spacing_mm);
        let mut values = vec![vec![0f32; nodes.len()]; 3];
        for segment in &mesh.segments {
            let [x, y, z] = segment.at.map(|v| v as usize);
            let own = segment.nodes().enumerate();
            for (i, node) in own.filter(|(_, node)| mesh.around[*node] != 0) {
                let at = nodes.index([x + i, y, z]);
                (0..3).for_each(|a| values[a][at] = self.solved.force[node][a] as f32);
            }
        }
        let [hx, hy, hz] = mesh.grid.spacing_mm;
        let straight = [
            [hx, 0.0, 0.0, 0.0],
            [0.0, hy, 0.0, 0.0],
            [0.0, 0.0, hz, 0.0],
        ];
        let affine = bone.affine.unwrap_or(straight);
        let affine = affine.map(|[x, y, z, o]| [x, y, z, o - 0.5 * (x + y + z)]);
        let volume = |values| Volume {
            affine: Some(affine),
            ..Volume::from_vec(nodes, values)
        };
        FieldVolume {
            name: "nodal_force_n".to_owned(),
            components: values.into_iter().map(volume).collect(),
            labels: AXES,
            place: Place::Nodes,
            about: "force of the supports on the nodes (corners of voxels) along x, y, z, N"
                .to_owned(),
        }
    }
}

fn about_sed(sed: Sed) -> String {
    format!("strain energy density, MPa, {}", sed.in_words())
}

fn one(
    name: &str,
    components: Vec<Volume<f32>>,
    labels: &'static [&'static str],
    about: String,
) -> FieldVolume {
    FieldVolume {
        name: name.to_owned(),
        components,
        labels,
        place: Place::Voxels,
        about,
    }
}
