//! Owns values on a grid, and the segmented specimen that the later stages work on.

use crate::grid::{Axis, Grid};
use ndarray::Array3;

/// Values on a voxel grid. `values` has shape `(nz, ny, nx)` in standard layout: x is fastest.
#[derive(Debug, Clone)]
pub struct Volume<T> {
    /// Number and size of the voxels.
    pub grid: Grid,
    /// One value a voxel.
    pub values: Array3<T>,
    /// Rows of the voxel-to-world affine (mm) where the file gave one; None: axes as stored, origin at zero.
    pub affine: Option<[[f64; 4]; 3]>,
}

impl<T> Volume<T> {
    /// # Panics
    /// If `values` does not have the grid's length (a bug in the caller, not bad input).
    pub fn from_vec(grid: Grid, values: Vec<T>) -> Self {
        let [nx, ny, nz] = grid.n;
        let values = Array3::from_shape_vec((nz, ny, nx), values)
            .expect("as many values as the grid has voxels");
        Volume {
            grid,
            values,
            affine: None,
        }
    }

    /// The voxels `crop[a][0]..crop[a][1]` along each axis, as a volume of its own at its place in the world.
    ///
    /// # Panics
    /// If the crop does not lie in the grid (a bug in the caller, not bad input).
    pub fn cropped(&self, crop: &[[usize; 2]; 3]) -> Volume<T>
    where
        T: Copy,
    {
        let [x, y, z] = crop.map(|[from, to]| from..to);
        let grid = Grid::new([x.len(), y.len(), z.len()], self.grid.spacing_mm);
        let part = self
            .values
            .slice(ndarray::s![z.clone(), y.clone(), x.clone()]);
        let mut cropped = Volume::from_vec(grid, part.iter().copied().collect());
        cropped.affine = self.affine.map(|rows| {
            rows.map(|[a, b, c, o]| {
                let corner = a * x.start as f64 + b * y.start as f64 + c * z.start as f64;
                [a, b, c, o + corner]
            })
        });
        cropped
    }

    /// All values, x fastest, to change.
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        self.values
            .as_slice_mut()
            .expect("volumes are kept in standard layout")
    }

    /// All values, x fastest.
    pub fn as_slice(&self) -> &[T] {
        self.values
            .as_slice()
            .expect("volumes are kept in standard layout")
    }
}

/// A segmented scan: which voxels are bone, and of what total volume.
#[derive(Debug, Clone)]
pub struct Specimen {
    /// Name of the scan.
    pub name: String,
    /// 1 where bone, 0 elsewhere.
    pub bone: Volume<u8>,
    /// Volume of interest in mm³, pores included (a cylinder's voxels, not its bounding box).
    pub tv_mm3: f64,
    /// How TV was defined, in words ("box", "cylinder d=10 mm", "mask FILE").
    pub tv_definition: String,
    /// Smoothed values of the scan, on the mask's grid: tissue that differs from voxel to voxel, and where the surface lies
    /// between voxels. None where nothing needs them.
    pub grey: Option<Volume<f32>>,
    /// How `bone` follows from `grey`. None: the surface within a voxel is a guess (a mask, labels).
    pub threshold: Option<Threshold>,
}

/// What makes bone of smoothed grey values.
#[derive(Debug, Clone)]
pub struct Threshold {
    /// Bone lies in `lower..=upper`.
    pub lower: f32,
    /// The upper end of that window.
    pub upper: f32,
    /// 1 inside the volume of interest; None: the whole grid.
    pub inside: Option<Volume<u8>>,
    /// Keep all bone, not only the largest 6-connected component.
    pub keep_all: bool,
    /// σ in voxels of all blur between the body and `grey` that is known: the scanner's and the smoothing.
    pub blur_voxels: Option<f64>,
    /// Whether the scanner's part of that was given, and not measured at edges of bone.
    pub is_blur_given: bool,
}

impl Specimen {
    /// Length of the specimen along `axis` in mm.
    pub fn length_mm(&self, axis: Axis) -> f64 {
        self.bone.grid.size_mm()[axis.index()]
    }

    /// Cross-section of the volume of interest in mm², pores included: TV / L.
    pub fn area_mm2(&self, axis: Axis) -> f64 {
        self.tv_mm3 / self.length_mm(axis)
    }

    /// Bone volume in mm³.
    pub fn bv_mm3(&self) -> f64 {
        let voxels = self.bone.as_slice().iter().filter(|&&b| b != 0).count();
        voxels as f64 * self.bone.grid.voxel_mm3()
    }

    /// Bone volume fraction, 0 to 1.
    pub fn bv_tv(&self) -> f64 {
        self.bv_mm3() / self.tv_mm3
    }
}
