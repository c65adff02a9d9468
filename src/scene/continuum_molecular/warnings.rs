//! Owns words on bonds that pull where they should push: they change how a result is read, and may be why there is none.

use super::check::Bodies;
use super::setup::Setup;
use super::solid::bending_moduli;
use super::{Elasticity, Molecular};
use crate::error::{Error, Result};
use crate::physics::continuum_molecular::tensor::PlaneTensor;

/// What is negative in some direction, a line each.
pub fn negative(model: &Molecular, setup: &Setup, bodies: &Bodies) -> Result<Vec<String>> {
    let mut words = Vec::new();
    if let (Some(elasticity), Some(tensor)) = (model.problem.elasticity(), bodies.tensor()) {
        elastic(elasticity, tensor, setup, &mut words)?;
    }
    if let Some((_, k)) = bodies.conductor() {
        let advice = "heat flows back along such bonds; raise conduction.exponent to the ratio of the principal conductivities";
        words.extend(lowest("micro-conductivity", k, setup, advice));
    }
    Ok(words)
}

fn elastic(
    elasticity: &Elasticity,
    tensor: &PlaneTensor,
    setup: &Setup,
    words: &mut Vec<String>,
) -> Result<()> {
    for negative in setup.micromoduli(elasticity, tensor)?.negative() {
        words.push(format!(
            "micromodulus {} is negative, {:.3} of the largest k_n at {:.0} degrees: the pair potential is not convex \
             there, and the body and its cracks may be unstable",
            negative.name, negative.relative_minimum, negative.direction_deg
        ));
    }
    if let Some(bending) = &elasticity.bending {
        let k = bending_moduli(bending, elasticity, setup)?;
        let advice = "raise bending.exponent above the ratio of the two moduli";
        words.extend(lowest("bending micromodulus", &k, setup, advice));
    }
    Ok(())
}

/// Names the lowest of the bonds' values `k` if it is negative.
fn lowest(name: &str, k: &[f64], setup: &Setup, advice: &str) -> Option<String> {
    let largest = k.iter().fold(0.0_f64, |m, k| m.max(k.abs()));
    let (bond, least) = setup
        .bonds
        .iter()
        .zip(k)
        .min_by(|a, b| a.1.total_cmp(b.1))?;
    (*least < -1e-12 * largest).then(|| {
        format!(
            "the {name} is negative, {:.3} of the largest at {:.0} degrees: {advice}",
            least / largest,
            bond.psi().to_degrees().rem_euclid(180.0)
        )
    })
}

/// The error of a factorisation, with `warnings` as what may be behind it.
pub fn with_warnings(error: Error, warnings: &[String]) -> Error {
    match error {
        Error::Specimen {
            found,
            advice,
            source,
        } if !warnings.is_empty() && found.contains("not positive definite") => Error::Specimen {
            found: format!("{found}; {}", warnings.join("; ")),
            advice: format!("change the material or its exponents, or {advice}"),
            source,
        },
        other => other,
    }
}
