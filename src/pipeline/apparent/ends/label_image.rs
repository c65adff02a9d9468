//! Owns the image whose labels are held, moved and pushed: the scan's own labels, or another image laid on its voxels.

use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::mask::runs::Run;
use crate::pipeline::apparent::params::SolveParams;
pub use crate::pipeline::apparent::params::{LabelImage, Laid};
use crate::volume::Specimen;
use std::borrow::Cow;
use std::collections::BTreeSet;

/// Labels by element of a model.
pub struct LabelMap<'a> {
    grid: Grid,
    labels: Cow<'a, [i32]>,
    /// Elements along an edge of a voxel.
    refine: usize,
    /// Where they are from, in words.
    source: String,
}

impl<'a> LabelMap<'a> {
    /// The labels that the settings name, of a specimen at the scan's own resolution.
    ///
    /// # Errors
    /// A scan without labels, an image that was not read, elements of several voxels.
    pub fn of(specimen: &Specimen, params: &'a SolveParams) -> Result<LabelMap<'a>> {
        if params.coarsen > 1 {
            return Err(Error::setting(
                "solve.coarsen",
                "supports by label stand on voxels, and elements of several voxels have no label",
                "leave --coarsen out, or crop the scan",
            ));
        }
        let grid = specimen.bone.grid;
        let (labels, source) = match &params.supports {
            Some(image) => (laid(image, grid)?, image.path.display().to_string()),
            None => (Cow::Owned(own(specimen)?), "the scan".to_owned()),
        };
        Ok(LabelMap {
            grid,
            labels,
            refine: params.refine,
            source,
        })
    }

    /// Those that occur, rising.
    pub fn all(&self) -> Vec<i32> {
        let found: BTreeSet<i32> = self.labels.iter().copied().filter(|l| *l != 0).collect();
        found.into_iter().collect()
    }

    /// Where the labels are from, in words.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// The label of an element; 0 outside of the grid.
    pub fn at(&self, element: [isize; 3]) -> i32 {
        let refine = self.refine as isize;
        let inside =
            (0..3).all(|a| element[a] >= 0 && element[a] < self.grid.n[a] as isize * refine);
        match inside {
            true => self.labels[self.grid.index(element.map(|v| (v / refine) as usize))],
            false => 0,
        }
    }

    /// Calls `visit` with each label of the eight voxels around a node, repeated ones too.
    pub fn around(&self, node: [usize; 3], mut visit: impl FnMut(i32)) {
        for corner in 0..8usize {
            let at = std::array::from_fn(|a| node[a] as isize - (corner >> a & 1) as isize);
            visit(self.at(at));
        }
    }

    /// Whether a run of elements has a node of one of these labels.
    pub fn touches(&self, run: Run, y: usize, z: usize, labels: &[i32]) -> bool {
        let near = |v: usize| v as isize - 1..=v as isize + 1;
        near(z).any(|z| {
            near(y).any(|y| {
                (run.x0 as isize - 1..=run.x1 as isize)
                    .any(|x| labels.contains(&self.at([x, y, z])))
            })
        })
    }
}

fn laid(image: &LabelImage, grid: Grid) -> Result<Cow<'_, [i32]>> {
    let Some(laid) = &image.laid else {
        return Err(Error::file(
            &image.path,
            "the label image was not read",
            "give a label image that exists, on the scan's grid",
        ));
    };
    if laid.labels.grid.n != grid.n {
        return Err(Error::file(
            &image.path,
            format!(
                "has {:?} voxels where the specimen has {:?}",
                laid.labels.grid.n, grid.n
            ),
            "give a label image on the scan's own grid",
        ));
    }
    Ok(Cow::Borrowed(laid.labels.as_slice()))
}

/// Labels of the scan itself, bone or not.
fn own(specimen: &Specimen) -> Result<Vec<i32>> {
    let grey = specimen.grey.as_ref();
    let grey = grey.filter(|g| specimen.threshold.is_none() && g.grid.n == specimen.bone.grid.n);
    let labels = grey.and_then(|grey| whole_numbers(grey.as_slice()));
    labels.ok_or_else(|| {
        Error::setting(
            "solve.supports",
            "supports by label are asked for, and the scan keeps no labels",
            "segment a labelled scan with --labels, or name a label image on the scan's grid: --supports FILE",
        )
    })
}

/// Values as labels; None where they are none.
pub fn whole_numbers(values: &[f32]) -> Option<Vec<i32>> {
    let label = |v: &f32| (*v == v.round() && v.abs() <= 1e6).then_some(*v as i32);
    values.iter().map(label).collect()
}
