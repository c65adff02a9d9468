//! Owns turning: the orientation of a body, and where its scan lies.

use super::super::waves::{Numbers, turn};

pub type Vec3 = [f64; 3];

pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn minus(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub fn plus(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub fn times(a: Vec3, s: f64) -> Vec3 {
    a.map(|v| v * s)
}

pub fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// The three axes of a body as unit vectors, right-handed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes(pub [Vec3; 3]);

impl Axes {
    /// Any orientation is as likely as another: a random unit quaternion (Shoemake 1992).
    pub fn random(numbers: Numbers) -> Self {
        let u = numbers.uniform(0);
        let [c1, s1] = turn(numbers.uniform(1));
        let [c2, s2] = turn(numbers.uniform(2));
        let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
        let [x, y, z, w] = [a * s1, a * c1, b * s2, b * c2];
        Axes([
            [
                1.0 - 2.0 * (y * y + z * z),
                2.0 * (x * y + z * w),
                2.0 * (x * z - y * w),
            ],
            [
                2.0 * (x * y - z * w),
                1.0 - 2.0 * (x * x + z * z),
                2.0 * (y * z + x * w),
            ],
            [
                2.0 * (x * z + y * w),
                2.0 * (y * z - x * w),
                1.0 - 2.0 * (x * x + y * y),
            ],
        ])
    }

    /// The third axis lies `tilt` degrees from z, towards `azimuth` degrees from x about z.
    pub fn tilted(tilt_degrees: f64, azimuth_degrees: f64) -> Self {
        let [ct, st] = turn(tilt_degrees / 360.0);
        let [ca, sa] = turn(azimuth_degrees / 360.0);
        Axes([
            [ct * ca, ct * sa, -st],
            [-sa, ca, 0.0],
            [st * ca, st * sa, ct],
        ])
    }

    /// A position in the body's own axes.
    pub fn inward(&self, p: Vec3) -> Vec3 {
        self.0.map(|axis| dot(axis, p))
    }

    /// A position in the body's own axes, seen from outside.
    pub fn outward(&self, p: Vec3) -> Vec3 {
        let [a, b, c] = self.0;
        plus(plus(times(a, p[0]), times(b, p[1])), times(c, p[2]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_right_handed_unit_vectors() {
        let random = (0..20).map(|seed| Axes::random(Numbers::new(seed, 9)));
        for axes in random.chain([Axes::tilted(30.0, 70.0), Axes::tilted(0.0, 0.0)]) {
            let [a, b, c] = axes.0;
            let cross = [
                a[1] * b[2] - a[2] * b[1],
                a[2] * b[0] - a[0] * b[2],
                a[0] * b[1] - a[1] * b[0],
            ];
            // turn() is good to 1e-9.
            assert!(norm(minus(cross, c)) < 1e-8, "{axes:?}");
            let p = [0.3, -2.0, 1.1];
            assert!(norm(minus(axes.outward(axes.inward(p)), p)) < 1e-8);
        }
        assert_eq!(
            Axes::tilted(0.0, 0.0).0,
            [[1.0, 0.0, -0.0], [-0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        );
    }
}
