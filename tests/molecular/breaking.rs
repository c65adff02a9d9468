//! The load of a fracture scene: what grows in proportion, where bonds never break, and the current through the body.

use super::{number, refused, solved, strip, strip_text, wired_strip};

const RAMP: &str = "value = { times = [0, 1], values = [0, 1] }";

/// The strip's load is a straight line from zero, at every corner of its schedule.
#[test]
fn loads_that_are_no_ramp_are_refused() {
    let text = strip_text("", 0.4);
    assert!(text.contains(RAMP));
    for load in [
        // Right at the end, and at half of it.
        "value = { times = [0, 0.1, 0.2, 0.3, 0.4], values = [0, 0.5, 0.2, 0.1, 0.4] }",
        "value = { times = [0, 0.1, 0.4], values = [0.1, 0.1, 0.4] }",
        "value = { until = [0.2, 0.4], values = [0.2, 0.4] }",
        "value = 0.1",
    ] {
        let error = refused(&text.replace(RAMP, load));
        let words = ["hold[2].value", "in proportion to time"];
        assert!(words.iter().all(|w| error.contains(w)), "{load}: {error}");
    }
    // A straight line may have corners; what comes after the end does not count.
    let straight = "value = { times = [0, 0.1, 0.4, 0.9], values = [0, 0.1, 0.4, 0] }";
    let (bent, _) = solved(&text.replace(RAMP, straight));
    let (plain, _) = strip("", 0.4);
    let breaks = |summary| number(summary, "broken_bonds");
    assert!(breaks(&bent) > 0.0 && breaks(&bent) == breaks(&plain));
}

/// Bonds never break at held points, which is said: those of the lower and of the upper edge. Where all are held, in
/// whatever component, nothing could break.
#[test]
fn points_at_which_bonds_never_break_are_counted() {
    let (summary, kept) = solved(&strip_text("", 0.02));
    assert_eq!(number(&summary, "sound_points"), 60.0);
    let said = "bonds never break at 60 of 600 points";
    assert!(
        kept.words.iter().any(|w| w.contains(said)),
        "{:?}",
        kept.words
    );
    for component in ["rotation", "x"] {
        let all = format!("hold = [{{ region = 'all', component = '{component}' }},");
        let error = refused(&strip_text("", 0.4).replace("hold = [", &all));
        assert!(error.contains("no bond could break"), "{error}");
    }
}

/// The current is that of the load's own time: where it grows with the load, so does the potential.
#[test]
fn a_current_follows_its_schedule() {
    let text = wired_strip(0.04);
    let grows = text.replace(
        "'potential', value = 1 }",
        &format!("'potential', {RAMP} }}"),
    );
    assert_ne!(text, grows);
    let ((_, steady), (_, growing)) = (solved(&text), solved(&grows));
    let (steady, growing) = (
        steady.column("potential_drop"),
        growing.column("potential_drop"),
    );
    assert_eq!(growing[0], 0.0);
    for (k, (one, ramp)) in steady.iter().zip(&growing).enumerate() {
        let expected = 0.02 * k as f64 * one;
        assert!(
            (ramp - expected).abs() < 1e-12 * one,
            "{k}: {ramp} {expected}"
        );
    }
}

/// Once the strip is through, the current has no path: that is said once, and no number is given.
#[test]
fn a_current_without_a_path_has_no_potential() {
    let (_, kept) = solved(&wired_strip(0.4));
    let drop = kept.column("potential_drop");
    assert!(
        drop[0].is_finite() && drop.last().unwrap().is_nan(),
        "{drop:?}"
    );
    assert!(
        drop.iter().filter(|d| d.is_finite()).all(|d| *d < 1e3),
        "{drop:?}"
    );
    let said: Vec<_> = kept
        .warnings
        .iter()
        .filter(|w| w.contains("no path"))
        .collect();
    assert_eq!(said.len(), 1, "{said:?}");
}

/// What is not read is not written.
#[test]
fn only_probes_have_a_potential_drop() {
    let text = wired_strip(0.02).replace(", probes = [[-14.5, 1.5], [-14.5, -1.5]]", "");
    let (_, kept) = solved(&text);
    let names = &kept.frames.last().unwrap().numbers;
    assert!(
        names.iter().all(|(n, _)| n != "potential_drop"),
        "{names:?}"
    );
}
