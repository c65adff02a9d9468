//! What a scene of remodelling leaves out costs nothing: unknowns, and numbers kept from step to step.

use super::shear::bar;
use bonepd_ct::discretisation::plane::Points;
use bonepd_ct::error::Result;
use bonepd_ct::scene::frame::{Frame, Observer};
use bonepd_ct::scene::setting::Inputs;
use bonepd_ct::scene::state::State;
use bonepd_ct::scene::{Scene, run};
use std::collections::BTreeMap;
use std::path::Path;

/// Keeps the size of each array of the last state.
#[derive(Default)]
struct Sizes(BTreeMap<String, usize>);

impl Observer for Sizes {
    fn start(&mut self, _: &Points, _: usize) -> Result<()> {
        Ok(())
    }
    fn frame(&mut self, _: &Frame) -> Result<()> {
        Ok(())
    }
    fn say(&mut self, _: &str) {}
    fn keep(&mut self, state: &dyn Fn() -> State) -> Result<()> {
        let state = state();
        let size = |(name, values): (&str, &[f64])| (name.to_owned(), values.len());
        self.0 = state.arrays().map(size).collect();
        Ok(())
    }
}

/// Unknowns, and the sizes of the arrays that depend on the number of points, of a bar of 12 x 4 points.
fn cost(model: &str) -> (usize, BTreeMap<String, usize>) {
    let text = bar(
        4,
        1e-5,
        &format!("{model}\n solver = {{ method = 'newton' }}"),
    );
    let scene = Scene::parse(&text, Path::new("test.toml")).unwrap();
    let mut sizes = Sizes::default();
    let summary = run(&scene, &Inputs::default(), &mut sizes).unwrap();
    assert_eq!((summary.points, summary.converged), (48, true));
    // Where a factor was made is told in copies of the same arrays.
    sizes
        .0
        .retain(|name, size| *size >= summary.points && !name.starts_with("factor."));
    (summary.unknowns, sizes.0)
}

fn sizes<const N: usize>(of: [(&str, usize); N]) -> BTreeMap<String, usize> {
    of.map(|(name, size)| (name.to_owned(), size)).into()
}

/// Without `poisson`, `cases` and growth there are two unknowns a point and no rotations; what was added later adds its own values and no
/// others. One column of four points is held along x, one point along y. No array is as long as the list of bonds.
#[test]
fn what_is_not_asked_for_is_not_stored() {
    let (n, held) = (48, 4 + 1);
    let growth = "growth = { rate = 1e5, stimulus = 5e-7 }";
    let cases = "cases = [{ name = 'a', weight = 1 }, { name = 'b', weight = 2 }]";
    let plain = cost("");
    let places = 2 * n - held;
    assert_eq!(
        plain,
        (
            places,
            sizes([("q", places), ("values", 3 * n), ("old", n)])
        )
    );
    // Poisson's ratio of bonds under stretch alone is no other model.
    assert_eq!(cost("poisson = 0.3333333333333333"), plain);
    let growing = places + n;
    assert_eq!(
        cost(growth),
        (
            growing,
            sizes([("q", growing), ("values", 3 * n), ("old", n)])
        )
    );
    let turning = 3 * n - held;
    assert_eq!(
        cost("poisson = 0.2"),
        (
            turning,
            sizes([("q", turning), ("values", 4 * n), ("old", n)])
        )
    );
    // Load cases share densities.
    let both = n + 2 * turning;
    assert_eq!(
        cost(&format!("poisson = 0.2\n {cases}\n {growth}")),
        (both, sizes([("q", both), ("values", 7 * n), ("old", n)]))
    );
    let central = n + 2 * places;
    assert_eq!(
        cost(&format!("{cases}\n {growth}")),
        (
            central,
            sizes([("q", central), ("values", 5 * n), ("old", n)])
        )
    );
}
