//! Modes that share a frequency.

use super::{Kept, number, solved};
use bonepd_ct::scene::frame::Summary;

fn square(size: usize, modes: usize) -> (Summary, Kept) {
    solved(&format!(
        "title = 'square'
        [geometry.rectangle]
        size = [{size}, {size}]
        [grid]
        spacing = 1
        horizon_ratio = 3
        partial_volumes = true
        [physics.continuum-molecular.elasticity]
        young = 1
        poisson = 0.3
        [physics.continuum-molecular.vibration]
        density = 1
        modes = {modes}"
    ))
}

/// A square has three rigid modes and pairs of equal frequencies: however many modes are asked for, they are the lowest.
#[test]
fn a_square_has_the_same_modes_however_many_are_asked_for() {
    let frequencies = |modes: usize| -> Vec<f64> {
        let (summary, _) = square(20, modes);
        assert!(summary.converged);
        (1..=modes)
            .map(|k| number(&summary, &format!("frequency_{k}")))
            .collect()
    };
    let all = frequencies(12);
    assert!(all[..3].iter().all(|f| *f < 1e-6), "rigid modes: {all:?}");
    let pairs = all[3..].windows(2).filter(|w| w[1] - w[0] < 1e-9 * w[1]);
    assert!(pairs.count() >= 2, "{all:?}");
    for count in 1..=8 {
        for (few, many) in frequencies(count).iter().zip(&all) {
            assert!(
                (few * few - many * many).abs() < 1e-9 * all[3].max(*many).powi(2),
                "{count}: {few} {many}"
            );
        }
    }
}

/// Four points have twelve unknowns: no more modes than that, and words.
#[test]
fn more_modes_than_unknowns_are_said_to_be_too_many() {
    let (summary, kept) = square(2, 20);
    assert_eq!((summary.unknowns, summary.steps), (12, 12));
    let said = |w: &String| w.contains("12 modes found of the 20 asked for");
    assert!(kept.words.iter().any(said), "{:?}", kept.words);
}
