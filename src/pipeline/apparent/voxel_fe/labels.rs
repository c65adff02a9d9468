//! Owns the labels of a segmented scan by element: which tissues there are, and which an element is of.

use crate::error::{Error, Result};
use crate::pipeline::apparent::params::SolveParams;
use crate::volume::Specimen;
use std::collections::BTreeSet;

/// More values than this in the bone are no labels.
const MOST: usize = 64;

/// Labels of a scan's bone.
pub struct Labels {
    /// Those that occur, rising.
    values: Vec<i32>,
    /// By voxel of the scan.
    of: Vec<i32>,
}

impl Labels {
    /// Of a scan that was segmented by labels, where the settings need them and elements are of one voxel each.
    ///
    /// # Errors
    /// Labels asked for that the scan or coarser elements do not have.
    pub fn of(specimen: &Specimen, params: &SolveParams) -> Result<Option<Labels>> {
        if !params.needs_labels() {
            return Ok(None);
        }
        let labels = match params.coarsen {
            1 => labels(specimen),
            _ => None,
        };
        for wanted in &params.failure_labels {
            let known = labels.as_ref().map_or(&[][..], |l| &l.values);
            if !known.contains(wanted) {
                return Err(missing(*wanted, known, params));
            }
        }
        Ok(labels)
    }

    /// Those that occur, rising.
    pub fn all(&self) -> &[i32] {
        &self.values
    }

    /// Those that tables tell apart: none where all bone has one.
    pub fn several(&self) -> &[i32] {
        match self.values.len() {
            1 => &[],
            _ => &self.values,
        }
    }

    /// That of a voxel.
    pub fn at(&self, voxel: usize) -> i32 {
        self.of[voxel]
    }
}

/// Values that are labels: whole numbers, few of them, of a scan without a threshold.
fn labels(specimen: &Specimen) -> Option<Labels> {
    let grey = specimen.grey.as_ref()?;
    let bone = specimen.bone.as_slice();
    if specimen.threshold.is_some() || grey.grid.n != specimen.bone.grid.n {
        return None;
    }
    let mut values = BTreeSet::new();
    for (value, _) in grey.as_slice().iter().zip(bone).filter(|(_, b)| **b != 0) {
        if *value != value.round() || value.abs() > 1e6 || values.len() > MOST {
            return None;
        }
        values.insert(*value as i32);
    }
    Some(Labels {
        values: values.into_iter().collect(),
        of: grey.as_slice().iter().map(|v| *v as i32).collect(),
    })
}

fn missing(wanted: i32, known: &[i32], params: &SolveParams) -> Error {
    let names: Vec<String> = known.iter().map(i32::to_string).collect();
    let (found, advice) = match (known, params.coarsen) {
        ([], 1) => (
            format!("label {wanted} is asked for, and the scan keeps no labels"),
            "segment a labelled scan with --labels, or leave --failure-labels out".to_owned(),
        ),
        ([], _) => (
            format!("label {wanted} is asked for, and elements of several voxels have no label"),
            "leave --coarsen or --failure-labels out".to_owned(),
        ),
        _ => (
            format!("no bone has the label {wanted}"),
            format!("name one of {}", names.join(", ")),
        ),
    };
    Error::setting("solve.failure_labels", found, advice)
}
