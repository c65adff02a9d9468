//! Owns what an image leaves open about a body's stiffness, as a stated error that holds for about 95 % of bodies.
//!
//! The truth is the body's, not the voxel staircase's. The constants were set on one half of a truth set of analytic bodies
//! (lattices, foams, broken and cracked ones, triply periodic surfaces; struts of 4 to 8 voxels) and checked on the other
//! half: `tests/bench/truth_set.py`, `reports/truth-set.csv`.
//!
//! Three features of a body decide, all in parts of its modulus:
//! - `S`, the relative change of E_app for a surface moved by one voxel (times 3/2): the energy density at the surface times
//!   surface over volume. Bent and thin struts have a large one.
//! - `NB`, the change of E_app when the image is smoothed once more by 0.7 voxels: what vanishes and what closes when
//!   resolution falls.
//! - `D`, the change of E_app from one element a voxel to finer elements of interpolated grey values.

use crate::result::row::Row;
use crate::result::settings::Elements;

/// σ in voxels of the smoothing that `NB` is the effect of.
pub const AGAIN_VOXELS: f64 = 0.7;

/// σ in voxels of an image's blur from which on its edges count as blurred. Sharper images are taken for means over voxels.
pub const BLURRED_VOXELS: f64 = 0.35;

/// Ratio of bodies for which no energy density is known: the mean of the truth set.
const USUAL_RATIO: f64 = 4.0 / 3.0;

/// σ in voxels of the blurred images of the truth set: 0.7 of the scanner, 0.5 of the smoothing.
const TRUTH_SET_BLUR: f64 = 0.86;

/// Shape error of one element a voxel of a mask, relative and over `S`.
const OF_A_MASK: f64 = 0.17;

/// What is known of the surface within a voxel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Image {
    /// A mask or labels: a guess.
    Mask,
    /// Grey values whose blur, smoothing included, has this σ.
    Grey {
        /// In voxels.
        blur_voxels: f64,
    },
}

/// Relative errors of a modulus.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stated {
    /// What finer elements of the same image would change.
    pub discretization: f64,
    /// What the image leaves open.
    pub shape: f64,
}

/// What `--error` has found out about a body in addition to the modulus that it states: all relative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Learnt {
    /// `S` of one element a voxel.
    pub surface: f64,
    /// `NB`.
    pub again: f64,
    /// `D`.
    pub refined: f64,
}

/// `S`: three times the energy density at the surface over the mean, over the mean thickness in voxels, `2 BV / BS`.
pub fn surface(ratio: Option<f64>, thickness_voxels: f64) -> f64 {
    3.0 * ratio.unwrap_or(USUAL_RATIO) / thickness_voxels
}

/// The error of finer elements of interpolated grey values.
pub fn of_interpolated(blur_voxels: f64, learnt: &Learnt) -> Stated {
    let blurred = (blur_voxels / TRUTH_SET_BLUR).max(0.0);
    // 7 % a voxel of sharp edges, 14 % of edges blurred by 0.86 voxels.
    let surface = (0.07 + 0.07 * blurred) * learnt.surface;
    let again = (1.0 - 0.4 * blurred.min(1.0)) * learnt.again;
    let shape = surface.hypot(again);
    let all = shape.hypot(0.8 * learnt.refined);
    Stated {
        discretization: all - shape,
        shape,
    }
}

/// Shape error of smooth elements, relative and over `S`: of sharp grey values, of those blurred by [`TRUTH_SET_BLUR`] and of masks.
/// Set on half A of the truth set: `tests/bench/geometry_fe.py`, `reports/geometry-fe.md`.
const SMOOTH_SHAPE: [f64; 3] = [0.05, 0.12, 0.09];

/// Discretisation error of smooth elements, relative and over `S` times the cell's edge in voxels. First order: cells fill what is
/// left between struts that meet at an acute angle. Where edges are blurred there is less of that.
const SMOOTH_CELLS: [f64; 3] = [0.025, 0.02, 0.03];

/// The error of smooth elements in cells of `size` voxels, from one solve. Their shape error grows with the difference of their Euler
/// number from that of the mask, in parts of the mask's, up to twice: `euler` holds both.
pub fn of_smooth(image: Image, size: f64, surface: f64, [mesh, mask]: [i64; 2]) -> Stated {
    let between = |[sharp, blurred, mask]: [f64; 3]| match image {
        Image::Grey { blur_voxels } => {
            let share = (blur_voxels / TRUTH_SET_BLUR).clamp(0.0, 1.0);
            sharp + share * (blurred - sharp)
        }
        Image::Mask => mask,
    };
    let apart = mesh.abs_diff(mask) as f64 / mask.unsigned_abs().max(1) as f64;
    Stated {
        discretization: between(SMOOTH_CELLS) * surface * size,
        shape: between(SMOOTH_SHAPE) * surface * (1.0 + apart.min(1.0)),
    }
}

/// The error of one element a voxel, or of coarser ones, from one solve.
///
/// `size` is the element's edge over the voxel's.
pub fn of_one_solve(image: Image, elements: Elements, size: f64, surface: f64) -> Option<Stated> {
    // 15 % a voxel: 10 of the shape, 5 of elements as large as voxels.
    let (shape, discretization) = match (elements, image) {
        (Elements::Voxels, Image::Grey { blur_voxels }) => {
            let blurred = (blur_voxels / TRUTH_SET_BLUR).max(0.0);
            (0.10 + 0.06 * blurred, 0.05)
        }
        // The blur of the scan it came from is not known, so that of a blurred one is taken.
        (Elements::Voxels | Elements::BlockMeans, Image::Mask) => (OF_A_MASK, 0.05),
        // Not measured by itself: no better than one element a voxel.
        (Elements::InterpolatedGrey | Elements::BlockMeans, Image::Grey { blur_voxels }) => {
            let blurred = (blur_voxels / TRUTH_SET_BLUR).max(0.0);
            (0.10 + 0.06 * blurred, 0.05)
        }
        // Split voxels converge to the voxel staircase, which is another body. Smooth elements: see `of_smooth`.
        _ => return None,
    };
    let coarse = size.max(1.0);
    Some(Stated {
        discretization: discretization * surface * coarse.powi(2),
        shape: shape * surface * coarse,
    })
}

/// Part of a stated error up to which finer elements may move a modulus that they agree with: what the image leaves open comes
/// on top of what elements do.
const AGREED: f64 = 0.7;

/// Largest over smallest modulus of labelled tissues up to which their interfaces, which voxels show as steps, are no worse known
/// than the surface. Beyond, no error is stated: tilted layers 1:10 were 19 times what was stated of them.
pub const MOST_CONTRAST: f64 = 2.0;

/// Says so in the note of a row.
pub const INTERFACES: &str =
    "no error is stated: the error of voxels at interfaces between unlike tissues is not known";

/// The error of one element a voxel whose modulus finer elements, of `of_fine`, put outside its stated `error`; None where they
/// agree. `moduli`: that of one element a voxel, that of finer ones.
pub fn contradicted(error: Option<f64>, moduli: (f64, f64), of_fine: Stated) -> Option<Stated> {
    let (one, fine) = moduli;
    let apart = (one - fine).abs() / one;
    (apart > AGREED * error?).then(|| Stated {
        discretization: apart + of_fine.discretization * fine / one,
        shape: of_fine.shape * fine / one,
    })
}

/// The shape error of a lattice's modulus, relative: that of a mask. None where the thickness of struts is not known.
pub fn of_lattice(row: &Row) -> Option<f64> {
    let voxel_mm = row.key.voxel_mm.iter().product::<f64>().cbrt();
    let thickness = row.marks.mean_thickness_mm? / voxel_mm;
    Some(OF_A_MASK * surface(None, thickness))
}

/// Puts the stated parts into a row, as shares of its modulus.
pub fn state(row: &mut Row, stated: Option<Stated>) {
    if let Some(solved) = &mut row.solved
        && let Some(e_app_mpa) = solved.e_app_mpa
    {
        solved.discretization_error_mpa = stated.map(|s| s.discretization * e_app_mpa);
        solved.shape_error_mpa = stated.map(|s| s.shape * e_app_mpa);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_add_up_to_the_quadratic_sum_of_what_was_learnt() {
        let learnt = Learnt {
            surface: 1.0,
            again: 0.03,
            refined: 0.05,
        };
        let sharp = of_interpolated(0.0, &learnt);
        let expected = (0.07f64.powi(2) + 0.03f64.powi(2) + 0.04f64.powi(2)).sqrt();
        assert!((sharp.discretization + sharp.shape - expected).abs() < 1e-12);
        let blurred = of_interpolated(0.86, &learnt);
        let expected = (0.14f64.powi(2) + 0.018f64.powi(2) + 0.04f64.powi(2)).sqrt();
        assert!((blurred.discretization + blurred.shape - expected).abs() < 1e-12);
    }

    #[test]
    fn a_contradicted_model_reaches_the_finer_one_and_its_error() {
        let of_fine = Stated {
            discretization: 0.1,
            shape: 0.1,
        };
        assert_eq!(contradicted(Some(0.3), (10.0, 8.0), of_fine), None);
        assert_eq!(contradicted(None, (10.0, 8.0), of_fine), None);
        let stated = contradicted(Some(0.15), (10.0, 8.0), of_fine).unwrap();
        // From 10 down to 8 and 20 % of that.
        assert!((stated.discretization + stated.shape - 0.36).abs() < 1e-12);
    }

    #[test]
    fn errors_grow_with_thin_struts_large_elements_and_blur() {
        let total = |image, elements, size, t| {
            let stated = of_one_solve(image, elements, size, surface(None, t)).unwrap();
            stated.discretization + stated.shape
        };
        let sharp = Image::Grey { blur_voxels: 0.0 };
        let blurred = Image::Grey { blur_voxels: 0.9 };
        let one = total(sharp, Elements::Voxels, 1.0, 4.0);
        assert!((one - 0.15).abs() < 1e-12, "{one}");
        assert!(total(sharp, Elements::Voxels, 1.0, 8.0) < one);
        assert!(total(blurred, Elements::Voxels, 1.0, 4.0) > one);
        assert!(total(Image::Mask, Elements::Voxels, 1.0, 4.0) > one);
        assert!(total(sharp, Elements::BlockMeans, 2.0, 4.0) > 2.0 * one);
        assert_eq!(of_one_solve(sharp, Elements::SplitVoxels, 0.5, 1.0), None);
    }

    #[test]
    fn errors_of_smooth_elements_grow_with_cells_blur_and_another_topology() {
        let total = |image, size, mesh| {
            let stated = of_smooth(image, size, 2.0, [mesh, -10]);
            stated.discretization + stated.shape
        };
        let grey = |blur_voxels| Image::Grey { blur_voxels };
        let sharp = total(grey(0.0), 1.0, -10);
        assert!((sharp - 2.0 * (0.025 + 0.05)).abs() < 1e-12, "{sharp}");
        assert!(total(grey(0.0), 2.0, -10) > sharp);
        let other = total(grey(0.0), 1.0, -15);
        assert!(
            (other - 2.0 * (0.025 + 1.5 * 0.05)).abs() < 1e-12,
            "{other}"
        );
        assert_eq!(total(grey(0.0), 1.0, 90), total(grey(0.0), 1.0, -20));
        let blurred = total(grey(TRUTH_SET_BLUR), 1.0, -10);
        assert!((blurred - 2.0 * (0.02 + 0.12)).abs() < 1e-12, "{blurred}");
        assert!(total(Image::Mask, 1.0, -10) > sharp);
    }
}
