//! Owns the forces and moments that the supports put on both ends.

use crate::pipeline::apparent::ends::motion::EndMotion;
use crate::result::details::EndForces;

/// One end of a specimen along its load axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The end of smaller coordinates.
    Lower,
    /// The end of larger coordinates.
    Upper,
}

impl End {
    /// The end that a place belongs to: up to `low` or from `high` on.
    pub fn at<T: PartialOrd>(place: T, low: T, high: T) -> Option<End> {
        match place {
            _ if place <= low => Some(End::Lower),
            _ if place >= high => Some(End::Upper),
            _ => None,
        }
    }

    /// The word of `reactions.csv`.
    pub fn name(self) -> &'static str {
        match self {
            End::Lower => "lower",
            End::Upper => "upper",
        }
    }
}

/// Sums of the nodal `force` (N) over both ends, moments about the middle of the grid at the innermost planes, `planes_mm` high.
/// `each` visits the sites of the ends with their places. Off to first order in the algebraic error.
pub fn reactions(
    motion: &EndMotion,
    planes_mm: [f64; 2],
    force: &[[f64; 3]],
    each: impl Fn(&mut dyn FnMut(usize, End, [f64; 3])),
) -> [EndForces; 2] {
    let middles = planes_mm.map(|height| motion.middle_at(height));
    let mut sums = [[[0.0; 3]; 2]; 2];
    each(&mut |site, end, place: [f64; 3]| {
        let (middle, f) = (middles[end as usize], force[site]);
        let r: [f64; 3] = std::array::from_fn(|a| place[a] - middle[a]);
        let moment = cross(r, f);
        for a in 0..3 {
            sums[end as usize][0][a] += f[a];
            sums[end as usize][1][a] += moment[a];
        }
    });
    [End::Lower, End::Upper].map(|end| {
        let [[fx, fy, fz], [mx, my, mz]] = sums[end as usize];
        let [x, y, z] = middles[end as usize];
        EndForces {
            end: end.name().to_owned(),
            force_x_n: fx,
            force_y_n: fy,
            force_z_n: fz,
            moment_x_nmm: mx,
            moment_y_nmm: my,
            moment_z_nmm: mz,
            about_x_mm: x,
            about_y_mm: y,
            about_z_mm: z,
        }
    })
}

/// The vector product.
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}
