//! Transient heat: held boundaries, jumps, order in time.

use super::{Kept, solved};

fn bar(spacing: f64, hold: &str, initial: f64, [step, end]: [f64; 2]) -> Kept {
    let text = format!(
        "title = 'bar'
        hold = [{hold}]
        [geometry.rectangle]
        size = [1, 0.1]
        [grid]
        spacing = {spacing}
        horizon_ratio = 3
        partial_volumes = true
        [time]
        end = {end}
        step = {step}
        [output]
        every = {step}
        [physics.continuum-molecular.conduction]
        conductivity = [2, 2, 0]
        calibrated = true
        capacity = 4
        initial = {initial}"
    );
    solved(&text).1
}

const HELD: &str = "{ region = { edge = 'left' }, component = 'temperature' },
    { region = { edge = 'right' }, component = 'temperature', value = 1 }";

/// Largest error of a bar at 0 whose right end is put at 1: T = s + Σ 2/(nπ) (-1)ⁿ sin(nπs) exp(-n²π²Dt/L²), s from one
/// held point to the other.
fn series_error(spacing: f64, t: f64) -> f64 {
    let kept = bar(spacing, HELD, 0.0, [t / 50.0, t]);
    let length = 1.0 - spacing;
    let exact = |x: f64| {
        let s = x / length + 0.5;
        let term = |n: i32| {
            let k = f64::from(n) * std::f64::consts::PI;
            let sign = if n % 2 == 0 { 1.0 } else { -1.0 };
            2.0 * sign / k * (k * s).sin() * (-k * k * 0.5 * t / (length * length)).exp()
        };
        s + (1..40).map(term).sum::<f64>()
    };
    let all = kept.positions.iter().zip(kept.scalar("temperature"));
    all.map(|(p, t)| (t - exact(p[0])).abs())
        .fold(0.0, f64::max)
}

/// Half the spacing, half the error (0.030 and 0.015 at t = 0.05): the held ends are a column of points each.
#[test]
fn a_bar_between_held_ends_warms_as_its_series() {
    for t in [0.05, 0.2] {
        let (coarse, fine) = (series_error(0.02, t), series_error(0.01, t));
        assert!(
            fine < 0.016 && coarse / fine > 1.9,
            "t = {t}: {coarse} {fine}"
        );
    }
}

/// A jump at the start does not swing by more than a thousandth of it (a quarter before): a warm bar between cold ends
/// cools. (Beyond the two damped steps, steps of 0.5 swing by 0.006: they are longer than the slowest mode lasts.)
#[test]
fn large_steps_do_not_make_heat_swing() {
    let hold = HELD.replace(", value = 1", "");
    for (step, count) in [(0.5, 2.0), (0.05, 10.0)] {
        let kept = bar(0.02, &hold, 1.0, [step, count * step]);
        let mut before = vec![1.0 + 1e-12; kept.positions.len()];
        for frame in &kept.frames {
            let now = Kept {
                frames: vec![frame.clone()],
                ..Kept::default()
            };
            let now = now.scalar("temperature").to_vec();
            for (now, before) in now.iter().zip(&before) {
                assert!(
                    *now >= -1e-3 && *now <= before + 1e-3,
                    "t = {}: {now} {before}",
                    frame.time
                );
            }
            before = now;
        }
    }
}

/// Half the step, a quarter of the error.
#[test]
fn heat_is_of_second_order_in_time() {
    let middle = |step: f64| {
        let kept = bar(0.02, HELD, 0.0, [step, 0.2]);
        let all = kept.positions.iter().zip(kept.scalar("temperature"));
        all.fold((1.0, 0.0), |m, (p, t)| {
            let d = (p[0] - 0.2).abs();
            if d < m.0 { (d, *t) } else { m }
        })
        .1
    };
    let exact = middle(0.2 / 800.0);
    let errors = [0.2 / 20.0, 0.2 / 40.0].map(|step| (middle(step) - exact).abs());
    let ratio = errors[0] / errors[1];
    assert!((ratio - 4.0).abs() < 0.4, "{errors:?}");
}
