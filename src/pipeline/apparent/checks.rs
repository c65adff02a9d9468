//! Owns which settings of a solve are refused, and in which words.

use crate::error::{Error, Result};
use crate::physics::plasticity::Plasticity;
use crate::pipeline::apparent::fields::Field;
use crate::pipeline::apparent::params::{CoarsenBy, Ends, Load, Method, MovedLabel, SolveParams};
use crate::result::settings::Motion;

impl SolveParams {
    /// Refuses what is no elastic material, no load or no accuracy.
    pub fn check(&self) -> Result<()> {
        let rules = [
            (
                "solve.young_mpa",
                self.young_mpa,
                self.young_mpa > 0.0,
                "a modulus in MPa above 0 (the paper: 1000)",
            ),
            (
                "solve.poisson",
                self.poisson,
                self.poisson > -1.0 && self.poisson < 0.5,
                "a ratio above -1 and below 0.5 (bone: 0.3; at 0.5 the material is incompressible and has no stiffness matrix)",
            ),
            (
                "solve.strain",
                self.strain,
                self.strain != 0.0,
                "a strain other than 0; negative is compression (the paper: -0.0042)",
            ),
            (
                "solve.grip_mm",
                self.grip_mm,
                self.grip_mm >= 0.0,
                "a thickness in mm; 0 grips the end planes (the paper: 0.6)",
            ),
            (
                "solve.tolerance",
                self.tolerance,
                self.tolerance > 0.0 && self.tolerance < 1.0,
                "a relative error between 0 and 1 (0.001 is 0.1 %)",
            ),
        ];
        for (key, value, ok, expected) in rules {
            if !ok || !value.is_finite() {
                return Err(Error::setting(
                    key,
                    format!("not usable: {value}"),
                    format!("give {expected}"),
                ));
            }
        }
        check_motion(self)?;
        check_labels(self)?;
        check_uneven(self)?;
        for (key, factor) in [
            ("solve.refine", self.refine),
            ("solve.coarsen", self.coarsen),
        ] {
            if factor == 0 {
                return Err(Error::setting(
                    key,
                    "found 0",
                    "give 1 or more; 1 is one element per voxel",
                ));
            }
        }
        if self.refine > 1 && self.coarsen > 1 {
            return Err(Error::setting(
                "solve.refine",
                format!(
                    "refine {} and coarsen {} exclude each other",
                    self.refine, self.coarsen
                ),
                "set one of them to 1",
            ));
        }
        if let Some(material) = &self.material {
            material.check(self.poisson)?;
        }
        if let Some(pistoia) = &self.pistoia {
            pistoia.check()?;
        }
        check_recorded(self)?;
        check_smooth(self)?;
        check_plasticity(self)?;
        if self.max_iterations == 0 {
            return Err(Error::setting(
                "solve.max_iterations",
                "0 iterations solve nothing",
                "give 1 or more",
            ));
        }
        Ok(())
    }
}

/// Refuses fields and numbers that the load or the method does not have.
fn check_recorded(params: &SolveParams) -> Result<()> {
    let wrong = |found: &str, advice: &str| Err(Error::setting("solve.fields", found, advice));
    let numbers = params.pistoia.is_some() || params.statistics;
    if params.load == Load::Stiffness && (numbers || !params.fields.is_empty()) {
        return wrong(
            "fields, statistics and the failure load come from one load",
            "add --load uniaxial, confined or another single load, or leave --fields, --statistics and --failure out",
        );
    }
    let of_elements = params
        .fields
        .iter()
        .any(|field| !Field::OF_LATTICES.contains(field));
    if params.method == Method::Lattice && (numbers || of_elements) {
        return wrong(
            "strains, stresses, statistics and the failure load come from voxel elements: a lattice has bonds, and no strain at its sites",
            "add --method voxel-fe, or ask for --fields displacement,sed,fraction,nodal-force of a lattice",
        );
    }
    if params.fields.contains(&Field::NodalForce) && params.refine.max(params.coarsen) > 1 {
        return wrong(
            "nodal forces lie on the nodes of the elements, which are not the corners of the voxels here",
            "leave --refine and --coarsen out, or the field nodal-force",
        );
    }
    if params.pistoia.is_none() && !params.failure_labels.is_empty() {
        return Err(Error::setting(
            "solve.failure_labels",
            "labels are given for a failure load that is not asked for",
            "add --failure, or leave the labels out",
        ));
    }
    Ok(())
}

/// Refuses what does not fit tissue that yields.
fn check_plasticity(params: &SolveParams) -> Result<()> {
    let wrong = |key: &str, found: &str, advice: &str| Err(Error::setting(key, found, advice));
    let Some(plasticity) = &params.plasticity else {
        return match params.fields.contains(&Field::PlasticStrain) {
            true => wrong(
                "solve.fields",
                "elastic tissue has no plastic strain",
                "add --plasticity, or leave the field plastic-strain out",
            ),
            false => Ok(()),
        };
    };
    plasticity.check()?;
    if params.method == Method::Lattice {
        return wrong(
            "solve.plasticity",
            "plasticity is of voxel elements: bonds of a lattice do not flow",
            "add --method voxel-fe, or leave --plasticity out",
        );
    }
    if params.load == Load::Labels {
        return wrong(
            "solve.plasticity",
            "supports by label are of elastic tissue",
            "leave --plasticity out, or load the ends (uniaxial, confined, shear)",
        );
    }
    if params.load.is_by_angle() || params.load == Load::Stiffness {
        return wrong(
            "solve.plasticity",
            "bending, torsion and unit strains have no stress-strain curve",
            "use --load uniaxial, confined or shear, or leave --plasticity out",
        );
    }
    if params.coarsen > 1 && params.coarsen_by == CoarsenBy::Fraction {
        return wrong(
            "solve.coarsen_by",
            "elements that are partly bone have no yield stress of their own",
            "use --coarsen-by threshold, or leave --coarsen out",
        );
    }
    if params.coarsen > 1 && matches!(plasticity, Plasticity::Labels(_)) {
        return wrong(
            "solve.plasticity",
            "elements of several voxels have no label",
            "leave --coarsen out, or give one law for all tissue",
        );
    }
    if params.pistoia.is_some() || params.statistics {
        return wrong(
            "solve.plasticity",
            "Pistoia's rule and the statistics are of elastic tissue",
            "leave --failure and --statistics out: the curve has the strength itself",
        );
    }
    if params
        .fields
        .iter()
        .any(|field| !Field::OF_YIELDED.contains(field))
    {
        return wrong(
            "solve.fields",
            "stresses and energy densities are written of elastic tissue only",
            "ask for displacement, strain, principal-strain, nodal-force or plastic-strain",
        );
    }
    Ok(())
}

/// Refuses uneven ends that do not fit the other settings.
///
/// # Errors
/// A depth below 0, another method, loads without ends, grips, tissue that yields, statistics of plane sections.
fn check_uneven(params: &SolveParams) -> Result<()> {
    let depth = params.ends_depth_mm;
    if depth == 0.0 {
        return Ok(());
    }
    let wrong =
        |found: String, advice: &str| Err(Error::setting("solve.ends_depth_mm", found, advice));
    if !(depth > 0.0 && depth.is_finite()) {
        return wrong(
            format!("not usable: {depth}"),
            "give a depth in mm above 0, or leave it out",
        );
    }
    if params.method != Method::VoxelFe {
        let found = format!(
            "uneven ends are of voxel elements, and the method is {}",
            params.method.name()
        );
        return wrong(
            found,
            "add --method voxel-fe, or cut the ends flat (segment --plane-cut)",
        );
    }
    if matches!(params.load.motion(), None | Some(Motion::ByLabel)) || params.load == Load::Confined
    {
        let found = format!(
            "load {} has no ends that a platen touches",
            params.load.name()
        );
        return wrong(
            found,
            "use --load uniaxial, shear, bending or torsion, or leave --ends-depth out",
        );
    }
    if params.grip_mm > 0.0 {
        let found =
            "grips hold the outer layers, a depth the bone that is seen from outside".to_owned();
        return wrong(found, "give --grip-mm or --ends-depth");
    }
    if params.coarsen > 1 && params.coarsen_by == CoarsenBy::Fraction {
        let found = "elements that are partly bone show no surface".to_owned();
        return wrong(found, "use --coarsen-by threshold, or leave --coarsen out");
    }
    if params.plasticity.is_some() || params.statistics {
        let found = "load steps and sections are taken between plane ends".to_owned();
        return wrong(
            found,
            "leave --plasticity and --statistics out, or cut the ends flat (segment --plane-cut)",
        );
    }
    Ok(())
}

/// Refuses supports by label that do not fit the other settings.
///
/// # Errors
/// Another load or method, nothing that loads, settings of ends.
fn check_labels(params: &SolveParams) -> Result<()> {
    let wrong = |key: &str, found: &str, advice: &str| Err(Error::setting(key, found, advice));
    if params.load != Load::Labels {
        return match (params.names_labels(), &params.supports) {
            (true, _) => wrong(
                "solve.load",
                &format!(
                    "labels are held, moved or pushed, and load {} moves ends",
                    params.load.name()
                ),
                "leave --load out (in a recipe: load = \"labels\"), or leave --held, --moved, --pushed out",
            ),
            (false, Some(_)) => wrong(
                "solve.supports",
                "a label image is given, and no label is held, moved or pushed",
                "add --held LABEL and --moved LABEL:ux,uy,uz or --pushed LABEL:fx,fy,fz",
            ),
            (false, None) => Ok(()),
        };
    }
    if params.method != Method::VoxelFe {
        return wrong(
            "solve.load",
            &format!(
                "supports by label stand on the corners of voxels, which {} does not have",
                params.method.name()
            ),
            "add --method voxel-fe",
        );
    }
    if params.moved.is_empty() && params.pushed.is_empty() {
        return wrong(
            "solve.moved",
            "no label is moved or pushed: nothing loads the bone",
            "add --moved LABEL:ux,uy,uz (mm) or --pushed LABEL:fx,fy,fz (N)",
        );
    }
    let is_still = |m: &MovedLabel| m.by_mm.iter().flatten().all(|v| *v == 0.0);
    if params.pushed.is_empty() && params.moved.iter().all(is_still) {
        return wrong(
            "solve.moved",
            "labels are moved by 0 mm and none is pushed: nothing loads the bone",
            "give a displacement other than 0 mm, or add --pushed LABEL:fx,fy,fz (N)",
        );
    }
    let moved = params.moved.iter().map(|m| m.label);
    let pushed = params.pushed.iter().map(|p| p.label);
    for (key, labels) in [
        ("solve.moved", moved.collect::<Vec<i32>>()),
        ("solve.pushed", pushed.collect()),
    ] {
        let twice = (1..labels.len()).find(|i| labels[..*i].contains(&labels[*i]));
        if let Some(i) = twice {
            return wrong(
                key,
                &format!("label {} is named twice", labels[i]),
                "name it once, with all its components",
            );
        }
    }
    if params.grip_mm > 0.0 || params.ends != Ends::Free {
        return wrong(
            "solve.ends",
            "grips and bonded ends are of loads that move ends; labels say themselves what is held",
            "leave --grip-mm and --ends out",
        );
    }
    Ok(())
}

/// Refuses motions that the settings cannot mean.
///
/// # Errors
/// A direction along the load axis, an angle of no turn, grips where ends tilt.
fn check_motion(params: &SolveParams) -> Result<()> {
    let wrong = |key: &str, found: String, advice: &str| {
        Err(Error::setting(format!("solve.{key}"), found, advice))
    };
    let (load, axis) = (params.load.name(), params.axis.name());
    let across = match params.load.motion() {
        Some(Motion::Sideways(direction)) => Some(direction),
        Some(Motion::Tilt(about)) => Some(about),
        _ => None,
    };
    if across == Some(params.axis) {
        return wrong(
            "load",
            format!("{load} is along the long axis {axis}"),
            "name a direction across it, or another --axis",
        );
    }
    if params.load.is_by_angle() && !(params.angle_deg != 0.0 && params.angle_deg.abs() < 90.0) {
        return wrong(
            "angle_deg",
            format!("not usable: {}", params.angle_deg),
            "give an angle in degrees other than 0 and below 90 (usual: 1)",
        );
    }
    if matches!(params.load.motion(), Some(Motion::Tilt(_))) && params.grip_mm > 0.0 {
        return wrong(
            "grip_mm",
            format!(
                "{load} tilts the end planes, and grips of {} mm would shear",
                params.grip_mm
            ),
            "leave --grip-mm out",
        );
    }
    Ok(())
}

/// Refuses a load without an apparent modulus where one is needed.
///
/// # Errors
/// Shear, bending, torsion.
pub fn needs_modulus(load: Load, key: &str) -> Result<()> {
    if load.has_modulus() {
        return Ok(());
    }
    Err(Error::setting(
        key,
        format!(
            "--error states the error of E_app, and {} has none",
            load.name()
        ),
        "leave --error out (the row states the solver's error), or use --load uniaxial",
    ))
}

/// Settings of smooth elements: usable, and not given to another method, where they would have no effect.
fn check_smooth(params: &SolveParams) -> Result<()> {
    if let Some(size) = params.element_mm
        && !(size > 0.0 && size.is_finite())
    {
        return Err(Error::setting(
            "solve.element_mm",
            format!("not usable: {size}"),
            "give a size in mm above 0, or leave it out: it then follows from the struts",
        ));
    }
    let given = [
        ("element_mm", params.element_mm.is_some()),
        ("surface", params.surface.is_some()),
    ];
    match given.into_iter().find(|(_, is_given)| *is_given) {
        Some((key, _)) if params.method != Method::GeometryFe => Err(Error::setting(
            format!("solve.{key}"),
            format!(
                "only geometry-fe has it, and the method is {}",
                params.method.name()
            ),
            "set the method to geometry-fe, or leave it out",
        )),
        _ => Ok(()),
    }
}
