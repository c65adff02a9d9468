//! What a continuum-molecular scene cannot be is refused in words, by a dry run and by a run alike.

use super::{Kept, PLATE, refused, solved, strip_text, wired_strip};
use bonepd_ct::scene::frame::Values;
use bonepd_ct::scene::setting::Inputs;
use bonepd_ct::scene::{Scene, check};
use std::collections::BTreeSet;
use std::path::Path;

const CLAMPED: &str = "hold = [{ region = { edge = 'left' }, component = 'x' },
    { region = { edge = 'left' }, component = 'y' }]";
const WARM: &str = "hold = [{ region = { edge = 'left' }, component = 'temperature', value = 1 }]";
const PULL: &str = "load = [{ region = { edge = 'right' }, component = 'x', value = 5 }]";
const STEEL: &str = "elasticity = { young = 1000, poisson = 0.2 }";
const CENTRAL: &str = "elasticity = { young = 1000, poisson = 0.3333333333333333 }";
const HEAT: &str = "conduction = { conductivity = [5, 1, 2] }";
const TIME: &str = "time = { end = 1, step = 0.5 }";

/// The plate with some keys of the scene and some of the model.
fn plate(scene: &str, model: &str) -> String {
    format!("{scene}\n{PLATE}\n[physics.continuum-molecular]\n{model}")
}

/// The error of a run, which is that of a dry run; it must hold all the `words`.
fn assert_refused(text: &str, words: &[&str]) {
    let scene = Scene::parse(text, Path::new("test.toml"));
    let error = match scene.and_then(|scene| check(&scene, &Inputs::default()).map(drop)) {
        Ok(_) => panic!("passed: {words:?} {text}"),
        Err(error) => error.to_string(),
    };
    for word in words {
        assert!(error.contains(word), "{word}: {error}");
    }
    assert_eq!(refused(text), error);
}

fn assert_runs(text: &str) {
    let scene = Scene::parse(text, Path::new("test.toml")).unwrap();
    check(&scene, &Inputs::default()).unwrap();
    solved(text);
}

#[test]
fn components_that_a_scene_has_not_are_refused() {
    let typo = |list: &str| format!("{CLAMPED}\n{}", PULL.replace("'x'", list));
    let none = [
        "load[0].component",
        "`xx`",
        "no component",
        "x, y, rotation",
    ];
    assert_refused(&plate(&typo("'xx'"), STEEL), &none);
    let held = CLAMPED.replace("'y'", "'yy'");
    assert_refused(&plate(&held, STEEL), &["hold[1].component", "`yy`"]);
    let heat = format!("{WARM}\n{PULL}");
    assert_refused(&plate(&heat, HEAT), &["load[0].component", "no elasticity"]);
    let cold = ["load[0].component", "no conduction"];
    assert_refused(&plate(&typo("'temperature'"), STEEL), &cold);
    let turned = typo("'rotation'");
    assert_refused(&plate(&turned, CENTRAL), &["`rotation`", "do not turn"]);
    assert_runs(&plate(&turned, STEEL));
}

#[test]
fn numbers_that_cannot_be_are_refused() {
    let pulled = format!("{CLAMPED}\n{PULL}");
    let elastic = |more: &str| plate(&pulled, &format!("{STEEL}\n{more}"));
    let of = |more: &str| elastic("").replace("0.2 }", &format!("0.2, {more} }}"));
    let model = "physics.continuum-molecular";
    assert_refused(&elastic("thickness = inf"), &["thickness", "inf"]);
    assert_refused(&elastic("thickness = -1"), &["thickness", "-1"]);
    let crack = format!("{model}.cracks[1][0]");
    let cracks = elastic("cracks = [[0, 0, 1, 1], [nan, 0, 1, 1]]");
    assert_refused(&cracks, &[&crack, "NaN"]);
    let heated = of("thermal = { expansion = [nan, 0, 0], rise = [1, 0, 0] }");
    let expansion = format!("{model}.elasticity.thermal.expansion[0]");
    assert_refused(&heated, &[&expansion]);
    let bent = of("bending = { first = -100, second = 100 }");
    assert_refused(&bent, &["elasticity.bending.first", "-100"]);
    let swept = elastic("sweep = { parameter = 'angle', values = [0, nan] }");
    assert_refused(&swept, &["sweep.values[1]"]);
    for exponent in ["0.5", "-1"] {
        let known = format!(
            "{HEAT}
            known = [{{ region = {{ box = [-20, -20, 0, 20] }}, field = {{ polynomial = [[{exponent}, 0, 1]] }} }}]"
        );
        assert_refused(&plate("", &known), &["polynomial", "whole", exponent]);
    }
    let modes = elastic("vibration = { density = 0, modes = 3 }").replace(PULL, "");
    assert_refused(&modes, &["vibration.density"]);
    // A region may reach to infinity.
    assert_runs(&elastic("").replace("{ edge = 'right' }", "{ box = [9, -inf, inf, inf] }"));
}

/// Bonds that pull where they should push are told of, and are named where the body cannot be solved.
#[test]
fn negative_micromoduli_are_named() {
    let warned = |text: &str| solved(text).1.warnings;
    let clean = warned(&plate(CLAMPED, STEEL));
    assert!(clean.is_empty(), "{clean:?}");
    let steep = warned(&plate(WARM, &HEAT.replace("[5, 1, 2]", "[5, 1, 0]")));
    assert!(steep.len() == 1 && steep[0].contains("micro-conductivity is negative"));
    assert!(steep[0].contains("at 90 degrees"), "{steep:?}");
    let soft = "elasticity = { moduli = [1000, 1000, 200, 295, 0, 0] }";
    let soft = warned(&plate(CLAMPED, soft));
    let named = "micromodulus k_t is negative";
    assert!(soft.len() == 1 && soft[0].contains(named), "{soft:?}");
    let bent = STEEL.replace("0.2 }", "0.2, bending = { first = 500, second = 100 } }");
    let bent = warned(&plate(CLAMPED, &bent));
    assert!(
        bent.len() == 1 && bent[0].contains("bending micromodulus"),
        "{bent:?}"
    );
    let steeper = HEAT.replace("[5, 1, 2]", "[500, 1, 0]");
    let failed = refused(&plate(WARM, &steeper));
    assert!(
        failed.contains("micro-conductivity is negative"),
        "{failed}"
    );
    let failed = refused(&plate(CLAMPED, &STEEL.replace("0.2", "0.4")));
    assert!(failed.contains("k_t is negative"), "{failed}");
}

/// What a map may show is what the scene writes.
#[test]
fn maps_may_show_the_scalars_that_are_written() {
    let scalars = |kept: &Kept| -> BTreeSet<String> {
        let fields = kept.frames.iter().flat_map(|f| &f.fields);
        let scalar = |f: &&bonepd_ct::scene::frame::Field| matches!(f.values, Values::Scalar(_));
        fields.filter(scalar).map(|f| f.name.to_owned()).collect()
    };
    for text in [
        plate(CLAMPED, STEEL),
        plate(CLAMPED, CENTRAL),
        plate(
            CLAMPED,
            &format!("{STEEL}\nvibration = {{ density = 1, modes = 2 }}"),
        ),
        plate(WARM, HEAT),
        plate(
            &format!("{WARM}\n{TIME}"),
            &HEAT.replace(" }", ", capacity = 1 }"),
        ),
        strip_text("", 0.02),
        wired_strip(0.02),
    ] {
        let mapped = |name: &str| format!("output.maps = ['{name}']\n{text}");
        let there = scalars(&solved(&text).1);
        assert_refused(&mapped("damge"), &["output.maps", "damge"]);
        let error = refused(&mapped("damge"));
        let list = error.split_once("this scene has ").unwrap().1;
        assert_eq!(
            list.split(", ").map(str::to_owned).collect::<BTreeSet<_>>(),
            there
        );
        assert_runs(&mapped(there.first().unwrap()));
    }
}

#[test]
fn an_end_that_is_no_whole_number_of_steps_is_refused() {
    let step = |text: &str, step: &str| text.replace("step = 0.02", step);
    let words = ["time.end", "not a whole number of steps"];
    assert_refused(&step(&strip_text("", 0.2), "step = 0.08"), &words);
    let heat = HEAT.replace(" }", ", capacity = 1 }");
    let warm = format!("{WARM}\n{}", TIME.replace("0.5", "0.4"));
    assert_refused(&plate(&warm, &heat), &words);
}

/// Keys that nothing would act on, each beside what would make it act.
#[test]
fn keys_without_effect_are_refused() {
    let pulled = format!("{CLAMPED}\n{PULL}");
    let elastic = |scene: &str, model: &str| {
        plate(&format!("{CLAMPED}\n{scene}"), &format!("{STEEL}\n{model}"))
    };
    let of = |from: &str, more: &str| plate(&pulled, &format!("elasticity = {{ {from}, {more} }}"));
    let moduli = "moduli = [1000, 1000, 200, 300, 0, 0]";
    let blocks = "tetrachiral = { block = 20, chirality_deg = 20, interface = 0.04, young = 10, poisson = 0.3 }";
    let heat = |scene: &str, more: &str| {
        plate(
            &format!("{WARM}\n{scene}"),
            &HEAT.replace(" }", &format!(", {more} }}")),
        )
    };
    let modes = "vibration = { density = 1, modes = 2 }";
    let hot = "thermal = { expansion = [1e-5, 1e-5, 0], rise = [1, 0, 0] }";
    let known = |field: &str, model: &str| {
        let known = format!("known = [{{ region = {{ edge = 'right' }}, {field} }}]");
        format!("{model}\n{known}")
    };
    let strain = "field = { strain = [1, 0, 0] }";
    let straight = "field = { polynomial = [[1, 0, 1]] }";
    let probes = "probes = [[0, 0], [1, 1]]";
    for (text, key) in [
        (of(moduli, "poisson = 0.45"), "elasticity.poisson"),
        (of(moduli, "plane = 'strain'"), "elasticity.plane"),
        (of(moduli, "plane = 'stress'"), "elasticity.plane"),
        (of(blocks, "plane = 'strain'"), "elasticity.plane"),
        (
            elastic("layers = { edges = ['top'], displacement = 1 }", ""),
            "layers",
        ),
        (
            elastic("probe = [{ name = 'a', region = 'all' }]", ""),
            "probe",
        ),
        (elastic(TIME, ""), "time"),
        (elastic(TIME, modes), "time"),
        (heat(TIME, "exponent = 2"), "time"),
        (heat("", "capacity = 1"), "conduction.capacity"),
        (heat("", "initial = 1"), "conduction.initial"),
        (
            heat(TIME, &format!("capacity = 1, {probes}")),
            "conduction.probes",
        ),
        (
            heat(&TIME.replace(" }", ", tolerance = 1e-3 }"), "capacity = 1"),
            "time.tolerance",
        ),
        (
            heat(
                &TIME.replace(" }", ", smallest_share = 0.1 }"),
                "capacity = 1",
            ),
            "time.tolerance",
        ),
        (plate(&pulled, &format!("{STEEL}\n{modes}")), "load"),
        (
            plate(
                CLAMPED,
                &format!(
                    "{}\n{modes}",
                    STEEL.replace("0.2 }", &format!("0.2, {hot} }}"))
                ),
            ),
            "elasticity.thermal",
        ),
        (
            elastic("", "sweep = { parameter = 'mixity', values = [0, 45] }"),
            "sweep.parameter",
        ),
        (plate(CLAMPED, &known(straight, STEEL)), "known[0].field"),
        (plate(WARM, &known(strain, HEAT)), "known[0].field"),
        (
            plate("", &known(&format!("{strain}, angle_deg = 10"), STEEL)),
            "known[0].angle_deg",
        ),
        (
            wired_strip(0.02).replace("exponent = 4,", "exponent = 4, capacity = 1,"),
            "conduction.capacity",
        ),
        (
            elastic("", "").replace("size = [20, 12]", "size = [20, 12]\nnodal = true"),
            "nodal",
        ),
    ] {
        assert_refused(&text, &[key, "found"]);
    }
    assert_runs(&of("young = 1000", "poisson = 0.2, plane = 'strain'"));
    assert_runs(&heat(TIME, "capacity = 1, initial = 1"));
    assert_runs(&plate("", &known(strain, STEEL)));
}

/// Tables that do not go together are refused where the file is read, with one piece of advice; so is a misspelt key.
#[test]
fn tables_that_do_not_go_together_are_refused() {
    let modes = "vibration = { density = 1, modes = 2 }";
    let fracture = "fracture = { energy = [1, 1] }";
    for (model, found, advice) in [
        (
            "thickness = 1",
            "neither elasticity nor conduction",
            "at least one",
        ),
        (modes, "without elasticity", "add the table of elasticity"),
        (
            &format!("{STEEL}\n{HEAT}"),
            "do not act on each other",
            "broken bonds stop conducting",
        ),
        (
            &format!("{STEEL}\n{fracture}\n{modes}"),
            "both fracture and vibration",
            "make two scenes",
        ),
        (
            &STEEL.replace("elasticity", "elastisity"),
            "unknown field `elastisity`",
            "did you mean `elasticity`?",
        ),
    ] {
        let error = refused(&plate(CLAMPED, model));
        let (before, after) = error.split_once("what to do: ").unwrap();
        assert!(
            before.contains("test.toml") && before.contains(found),
            "{error}"
        );
        assert!(after.contains(advice), "{error}");
        assert!(!after.contains("what to do"), "{error}");
    }
}

/// What a scene file says is what is written of it.
#[test]
fn a_scene_survives_writing() {
    let heat = HEAT.replace(" }", ", capacity = 1, initial = 2 }");
    for text in [
        plate(CLAMPED, STEEL),
        plate(&format!("{WARM}\n{TIME}"), &heat),
        wired_strip(0.02),
    ] {
        let scene = Scene::parse(&text, Path::new("test.toml")).unwrap();
        let written = toml::to_string(&scene).unwrap();
        assert_eq!(
            Scene::parse(&written, Path::new("test.toml")).unwrap(),
            scene
        );
    }
}

/// What is prescribed twice is refused: [[hold]] and known have no order.
#[test]
fn a_point_is_not_both_held_and_known() {
    let known = |edge: &str| {
        let field = "field = { strain = [0.1, 0, 0] }";
        format!("{STEEL}\nknown = [{{ region = {{ edge = '{edge}' }}, {field} }}]")
    };
    let words = ["known[0].region", "both prescribe x of the point"];
    assert_refused(&plate(CLAMPED, &known("left")), &words);
    let straight = "known = [{ region = 'all', field = { polynomial = [[1, 0, 1]] } }]";
    let warm = plate(WARM, &format!("{HEAT}\n{straight}"));
    assert_refused(&warm, &["known[0].region", "temperature or potential"]);
    assert_runs(&plate(CLAMPED, &known("right")));
}

/// Each fault has words of its own, which name a key of the scene.
#[test]
fn settings_are_named_where_they_are_wrong() {
    let strip = |from: &str, to: &str| strip_text("", 0.02).replace(from, to);
    let fracture = |more: &str| strip("tip = ", &format!("{more}\ntip = "));
    assert_refused(&fracture("batch = 1"), &["fracture.batch"]);
    assert_refused(&fracture("window_points = 0"), &["fracture.window_points"]);
    assert_refused(
        &fracture("frequency = 101"),
        &["fracture.frequency", "found 101"],
    );
    assert_refused(&fracture("frequency = 0"), &["fracture.frequency"]);
    assert_refused(
        &strip("[0.5, 0.5]", "[9, 0.5]"),
        &["fracture.energy", "ratio"],
    );
    let hot = "poisson = 0.2\nthermal = { expansion = [1e-5, 1e-5, 0], rise = [1, 0, 0] }";
    assert_refused(&strip("poisson = 0.2", hot), &["elasticity.thermal"]);
    let force = strip("hold = [", &format!("{PULL}\nhold = ["));
    assert_refused(&force, &["load[0].component", "not by forces"]);
    let elastic = |material: &str| plate(CLAMPED, &format!("elasticity = {{ {material} }}"));
    let rubber = elastic("young = 1, poisson = 0.5, plane = 'strain'");
    assert_refused(&rubber, &["elasticity.poisson", "below 0.5"]);
    assert_refused(&elastic("young = -1"), &["elasticity.young"]);
    let blocks = |angle: f64| {
        elastic(&format!(
            "tetrachiral = {{ block = 20, chirality_deg = {angle}, interface = 0.04, young = 10, poisson = 0.3 }}"
        ))
    };
    assert_refused(
        &blocks(60.0),
        &["elasticity.tetrachiral.chirality_deg", "45"],
    );
    assert_runs(&blocks(20.0));
    assert_refused(&plate("", HEAT), &["hold", "nothing holds"]);
}
