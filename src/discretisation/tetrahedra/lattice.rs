//! Owns the lattice that covers the box: corners of cells and their centres, the edges between them, and the tetrahedra.
//!
//! Places are in half cells: corners are even, centres odd. Tetrahedra stand about the cells' faces: two centres and an edge of
//! the face. At the box's faces half an octahedron is left, of one centre and the face, in two tetrahedra.
//! Planes across the box can be kept free of elements that reach through them, as its faces are: grips end there.

/// A vertex in half cells.
pub type Place = [u32; 3];

/// Edges of the lattice by length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum EdgeKind {
    /// Centre to corner.
    Short,
    /// Along an axis.
    Long,
    /// Across a face of the box.
    Diagonal,
}

/// Cells between planes that need not be equally far apart.
#[derive(Debug, Clone)]
pub struct Lattice {
    /// Cells along each axis.
    pub n: [usize; 3],
    planes_mm: [Vec<f64>; 3],
    /// Planes that no element reaches through: axis and place along it.
    inner: Vec<(usize, u32)>,
}

/// Planes through all the `stops`, ascending, about `size` apart.
pub fn planes(stops: &[f64], size: f64) -> Vec<f64> {
    let mut planes = vec![stops[0]];
    for pair in stops.windows(2) {
        let length = pair[1] - pair[0];
        if length <= 0.0 {
            continue;
        }
        let n = (length / size).round().max(1.0);
        planes.extend((1..=n as usize).map(|i| pair[0] + length * i as f64 / n));
    }
    planes
}

impl Lattice {
    /// # Panics
    /// Fewer than two planes along an axis.
    pub fn new(planes_mm: [Vec<f64>; 3]) -> Lattice {
        assert!(planes_mm.iter().all(|p| p.len() > 1), "no cell");
        let n = std::array::from_fn(|a| planes_mm[a].len() - 1);
        Lattice {
            n,
            planes_mm,
            inner: Vec::new(),
        }
    }

    /// The same with the planes across `axis` at the places `at_mm`, which are planes of it, kept free of elements that reach through them.
    pub fn ending_at(mut self, axis: usize, at_mm: &[f64]) -> Lattice {
        let planes = &self.planes_mm[axis];
        let rounding = 1e-9 * self.ends_mm()[axis];
        let is_at = |p: f64| at_mm.iter().any(|at| (p - at).abs() < rounding);
        let inside = (1..self.n[axis]).filter(|p| is_at(planes[*p]));
        self.inner = inside.map(|p| (axis, 2 * p as u32)).collect();
        self
    }

    /// The inner planes that no element reaches through: axis and place in mm.
    pub fn inner_mm(&self) -> Vec<(usize, f64)> {
        let place = |&(a, p): &(usize, u32)| (a, self.planes_mm[a][p as usize / 2]);
        self.inner.iter().map(place).collect()
    }

    /// Whether elements end at a plane across `axis`.
    fn is_flat(&self, axis: usize, place: u32) -> bool {
        place == 0 || place as usize == 2 * self.n[axis] || self.inner.contains(&(axis, place))
    }

    fn corners(&self) -> usize {
        self.n.iter().map(|n| n + 1).product()
    }

    /// Corners and centres.
    pub fn vertices(&self) -> usize {
        self.corners() + self.n.iter().product::<usize>()
    }

    pub fn number(&self, [x, y, z]: Place) -> usize {
        let [i, j, k] = [x, y, z].map(|v| v as usize / 2);
        let [nx, ny, _] = self.n;
        if x % 2 == 0 {
            (k * (ny + 1) + j) * (nx + 1) + i
        } else {
            self.corners() + (k * ny + j) * nx + i
        }
    }

    pub fn place(&self, number: usize) -> Place {
        let (at, more, [nx, ny, _]) = match number.checked_sub(self.corners()) {
            None => (number, 0, self.n.map(|n| n + 1)),
            Some(at) => (at, 1, self.n),
        };
        [at % nx, at / nx % ny, at / (nx * ny)].map(|v| 2 * v as u32 + more)
    }

    pub fn position_mm(&self, place: Place) -> [f64; 3] {
        std::array::from_fn(|a| {
            let (plane, planes) = (place[a] as usize / 2, &self.planes_mm[a]);
            match place[a] % 2 {
                0 => planes[plane],
                _ => 0.5 * (planes[plane] + planes[plane + 1]),
            }
        })
    }

    /// Where the box ends.
    pub fn ends_mm(&self) -> [f64; 3] {
        std::array::from_fn(|a| self.planes_mm[a][self.n[a]])
    }

    /// Whether a vertex lies on a plane that elements end at, by axis: a face of the box among them.
    pub fn on_faces(&self, place: Place) -> [bool; 3] {
        std::array::from_fn(|a| self.is_flat(a, place[a]))
    }

    /// The mean edge of the cells.
    pub fn size_mm(&self) -> f64 {
        let edge = |a: usize| {
            let planes = &self.planes_mm[a];
            (planes[planes.len() - 1] - planes[0]) / self.n[a] as f64
        };
        (edge(0) * edge(1) * edge(2)).cbrt()
    }

    /// Whether face diagonals end at a corner, of the face across `axis`.
    fn ends_diagonals(place: Place, axis: usize) -> bool {
        let [p, q] = [(axis + 1) % 3, (axis + 2) % 3];
        (place[p] / 2 + place[q] / 2).is_multiple_of(2)
    }

    /// Calls `visit` with every vertex that an edge joins to this one.
    pub fn each_neighbour(&self, place: Place, mut visit: impl FnMut(Place)) {
        let inside = |p: [i64; 3]| {
            let fits = |a: usize| p[a] >= 0 && p[a] <= 2 * self.n[a] as i64;
            (0..3).all(fits).then(|| p.map(|v| v as u32))
        };
        let place = place.map(i64::from);
        for corner in 0..8 {
            let step = |a: usize| if corner >> a & 1 == 1 { 1 } else { -1 };
            let to = std::array::from_fn(|a| place[a] + step(a));
            inside(to).into_iter().for_each(&mut visit);
        }
        let moved = |steps: [(usize, i64); 2]| {
            let mut to = place;
            steps.iter().for_each(|&(a, step)| to[a] += step);
            let through = place[0] % 2 == 1
                && (steps.iter())
                    .any(|&(a, step)| step != 0 && self.is_flat(a, (place[a] + step / 2) as u32));
            inside(to).filter(|_| !through)
        };
        for (a, step) in [(0, 2), (0, -2), (1, 2), (1, -2), (2, 2), (2, -2)] {
            moved([(a, step), (a, 0)]).into_iter().for_each(&mut visit);
        }
        if place[0] % 2 == 1 {
            return;
        }
        let corner = place.map(|v| v as u32);
        let on = self.on_faces(corner);
        for axis in (0..3).filter(|a| on[*a] && Lattice::ends_diagonals(corner, *a)) {
            let [p, q] = [(axis + 1) % 3, (axis + 2) % 3];
            for (s, t) in [(2, 2), (2, -2), (-2, 2), (-2, -2)] {
                moved([(p, s), (q, t)]).into_iter().for_each(&mut visit);
            }
        }
    }

    /// Calls `visit` with the vertices of every tetrahedron about faces across `axis` in the layer of cells `layer` along z.
    pub fn each_tetrahedron(&self, layer: usize, mut visit: impl FnMut([Place; 4])) {
        for axis in 0..3 {
            let mut last = self.n;
            last[axis] += 1;
            // Faces across z above the topmost cells belong to their layer.
            let top = axis == 2 && layer + 1 == self.n[2];
            for k in layer..layer + 1 + usize::from(top) {
                for j in 0..last[1] {
                    for i in 0..last[0] {
                        self.about_face(axis, [i, j, k], &mut visit);
                    }
                }
            }
        }
    }

    fn about_face(&self, axis: usize, at: [usize; 3], visit: &mut impl FnMut([Place; 4])) {
        let low: Place = at.map(|v| 2 * v as u32);
        let [p, q] = [(axis + 1) % 3, (axis + 2) % 3];
        let corner = |s: u32, t: u32| {
            let mut c = low;
            c[p] += s;
            c[q] += t;
            c
        };
        let ring = [corner(0, 0), corner(2, 0), corner(2, 2), corner(0, 2)];
        let centre = |above: bool| {
            let mut c = corner(1, 1);
            c[axis] = if above { c[axis] + 1 } else { c[axis] - 1 };
            c
        };
        if !self.is_flat(axis, low[axis]) {
            for e in 0..4 {
                visit([centre(false), centre(true), ring[e], ring[(e + 1) % 4]]);
            }
            return;
        }
        let first = usize::from(!Lattice::ends_diagonals(ring[0], axis));
        let corner = |e: usize| ring[(first + e) % 4];
        for above in [false, true] {
            if at[axis] == if above { self.n[axis] } else { 0 } {
                continue;
            }
            visit([centre(above), corner(0), corner(1), corner(2)]);
            visit([centre(above), corner(0), corner(2), corner(3)]);
        }
    }

    pub fn edge_kind(a: Place, b: Place) -> EdgeKind {
        if a[0] % 2 != b[0] % 2 {
            return EdgeKind::Short;
        }
        match (0..3).filter(|&c| a[c] != b[c]).count() {
            1 => EdgeKind::Long,
            _ => EdgeKind::Diagonal,
        }
    }
}
