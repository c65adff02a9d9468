//! Figures and tables of `reports/remodelling.md`, from the scenes' results under `out/` (or `$BONEPD_OUT`):
//! `cargo test --release --test all -- --ignored --nocapture remodelling_report`. Scenes that were not run are left out.

use bonepd_ct::io::{map, plot, points};
use bonepd_ct::stage::report::figure::{Axis, Content, Curve, Figure, Mark, Point};
use bonepd_ct::topology::plane::Points;
use image::{RgbImage, imageops};
use std::path::{Path, PathBuf};

const TIMES: [u32; 4] = [10, 100, 190, 280];
const HORIZONS: [&str; 4] = ["0.301", "0.601", "0.901", "1.201"];
const SPACING: f64 = 0.1;

fn results() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    std::env::var_os("BONEPD_OUT").map_or(root.join("out"), PathBuf::from)
}

fn pictures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("reports/remodelling")
}

#[test]
#[ignore = "needs the scenes' results"]
fn remodelling_report() {
    let local = |case: &str| results().join(format!("femur-{case}-continuum")).exists();
    assert!(
        local("lc1") || local("lc2") || results().join("square-continuum").exists(),
        "no scene's results in {}: run the scenes first, as reports/remodelling.md says, or name their folder in $BONEPD_OUT",
        results().display()
    );
    std::fs::create_dir_all(pictures()).unwrap();
    square_figures();
    for case in ["lc1", "lc2"] {
        let name = |kind: &str| format!("femur-{case}-{kind}");
        let local = name("continuum");
        sheet(&local, &format!("{case}-continuum"), None);
        for horizon in HORIZONS {
            let scene = name(&format!("delta-{horizon}"));
            sheet(&scene, &format!("{case}-delta-{horizon}"), None);
            let stem = format!("{case}-minus-{horizon}");
            sheet(&scene, &stem, Some(&local));
        }
        mean_densities(case);
        regions(case);
        differences(case);
    }
}

/// Mean relative density of the whole femur over time.
fn mean_densities(case: &str) {
    let local = ("local".to_owned(), format!("femur-{case}-continuum"));
    let horizons = HORIZONS.map(|h| (format!("δ = {h}"), format!("femur-{case}-delta-{h}")));
    curves(
        &format!("{case}-mean"),
        horizons.into_iter().chain([local]).collect(),
    );
}

/// Figures 4 and 5: mean relative density over time.
fn square_figures() {
    let local = ("local".to_owned(), "square-continuum".to_owned());
    let ratios = ["2.01", "2.5125", "4.02", "5.025", "8.04", "10.05"];
    let fixed = ratios.map(|r| (format!("δ/Δ = {r}"), format!("square-fixed-horizon-{r}")));
    curves("figure-4", fixed.to_vec());
    let horizons = [
        ("10", "0.301"),
        ("20", "0.1505"),
        ("40", "0.07525"),
        ("80", "0.037625"),
        ("160", "0.0188"),
        ("320", "0.0094"),
    ];
    let fixed = horizons.map(|(n, d)| (format!("δ = {d}"), format!("square-fixed-ratio-{n}")));
    curves("figure-5", fixed.into_iter().chain([local]).collect());
}

fn curves(stem: &str, scenes: Vec<(String, String)>) {
    let curve = |(k, (name, scene)): (usize, (String, String))| {
        let means = column(&scene, "mean")?;
        let last = means.last()?;
        println!("| {stem} | {name} | {:.5} | t = {} |", last.1, last.0);
        let points = means.iter().map(|(t, v)| Point::new(*t, *v)).collect();
        Some(Curve {
            name,
            hue: k,
            shape: k,
            mark: Mark::Rule,
            points,
        })
    };
    let content: Vec<Curve> = scenes.into_iter().enumerate().filter_map(curve).collect();
    if content.is_empty() {
        return;
    }
    let drawing = plot::draw(&Figure {
        stem: stem.to_owned(),
        scan: None,
        title: String::new(),
        caption: String::new(),
        x: Axis::linear("time"),
        y: Axis::linear("mean relative density change"),
        content: Content::Curves(content),
    });
    std::fs::write(
        pictures().join(format!("{stem}.png")),
        drawing.png().unwrap(),
    )
    .unwrap();
}

/// A column of a scene's history by time.
fn column(scene: &str, name: &str) -> Option<Vec<(f64, f64)>> {
    let mut reader = csv::Reader::from_path(results().join(scene).join("history.csv")).ok()?;
    let place = reader.headers().ok()?.iter().position(|h| h == name)?;
    let number = |text: &str| text.parse::<f64>().ok();
    let row = |r: csv::StringRecord| Some((number(&r[0])?, number(&r[place])?));
    reader
        .records()
        .filter_map(|r| r.ok().and_then(row))
        .collect::<Vec<_>>()
        .into()
}

/// Positions and relative densities of a scene at a time.
fn densities(scene: &str, t: u32) -> Option<Vec<([f64; 2], f64)>> {
    let file = results().join(scene).join(format!("fields_t{t}.csv"));
    file.exists()
        .then(|| points::read_column(&file, "density_change").unwrap())
}

/// Four times side by side, of densities or of their difference to another scene.
fn sheet(scene: &str, stem: &str, minus: Option<&str>) {
    let panel = |t: u32| {
        let mut rows = densities(scene, t)?;
        if let Some(other) = minus {
            let other = densities(other, t)?;
            rows.iter_mut().zip(&other).for_each(|(a, b)| a.1 -= b.1);
        }
        let cell = |p: &[f64; 2]| p.map(|v| (v / SPACING - 0.5).round() as i32);
        let cells = rows.iter().map(|(p, _)| cell(p)).collect();
        let values: Vec<f64> = rows.iter().map(|r| r.1).collect();
        let size = if minus.is_some() { 0.3 } else { 1.0 };
        let range = map::Range {
            low: -size,
            high: size,
        };
        let points = Points::from_cells([0.0; 2], SPACING, cells);
        let full = map::draw(&points, &values, range, f64::from(t));
        let half = [full.width() / 2, full.height() / 2];
        Some(imageops::resize(
            &full,
            half[0],
            half[1],
            imageops::FilterType::Nearest,
        ))
    };
    let panels: Vec<RgbImage> = TIMES.iter().filter_map(|t| panel(*t)).collect();
    let (Some(first), true) = (panels.first(), panels.len() == TIMES.len()) else {
        return;
    };
    let (w, h) = first.dimensions();
    let mut all = RgbImage::new(w * panels.len() as u32, h);
    for (k, panel) in panels.iter().enumerate() {
        imageops::replace(&mut all, panel, i64::from(w) * k as i64, 0);
    }
    map::write_png(&pictures().join(format!("{stem}.png")), &all).unwrap();
}

/// Mean (5 %, 95 %) of each region at t = 10 and 280 in every scene of a load case.
fn regions(case: &str) {
    const REGIONS: [&str; 10] = [
        "",
        "medial_shaft.",
        "lateral_shaft.",
        "shaft_core.",
        "principal_compressive.",
        "principal_tensile.",
        "wards_triangle.",
        "intertrochanteric.",
        "greater_trochanter.",
        "head.",
    ];
    let kinds = ["continuum".to_owned()].into_iter();
    let kinds: Vec<String> = kinds
        .chain(HORIZONS.map(|h| format!("delta-{h}")))
        .collect();
    for t in [10.0, 280.0] {
        println!("\n{case}, t = {t}\n\n| | {} |", kinds.join(" | "));
        println!("|---|{}", "---|".repeat(kinds.len()));
        for region in REGIONS {
            let cell = |kind: &String| {
                let at = |what: &str| {
                    let all = column(&format!("femur-{case}-{kind}"), &format!("{region}{what}"))?;
                    let row = all.into_iter().find(|(time, _)| (time - t).abs() < 1e-6)?;
                    Some(row.1)
                };
                match (at("mean"), at("p05"), at("p95")) {
                    (Some(m), Some(a), Some(b)) => format!("{m:.3} ({a:.3}, {b:.3})"),
                    _ => "-".to_owned(),
                }
            };
            let row: Vec<String> = kinds.iter().map(cell).collect();
            println!("| {} | {} |", region.trim_end_matches('.'), row.join(" | "));
        }
    }
}

/// Size of the difference to the continuum, and where the largest lie.
fn differences(case: &str) {
    println!(
        "\n{case}\n\n| δ | t | mean | 95 % | largest | at | > 0.1 | > 0.3 | head, trochanter among > 0.3 |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for horizon in HORIZONS {
        for t in TIMES {
            let scene = format!("femur-{case}-delta-{horizon}");
            let local = format!("femur-{case}-continuum");
            let (Some(here), Some(there)) = (densities(&scene, t), densities(&local, t)) else {
                continue;
            };
            let both = here.iter().zip(&there);
            let size: Vec<([f64; 2], f64)> = both.map(|(a, b)| (a.0, (a.1 - b.1).abs())).collect();
            let mut sorted: Vec<f64> = size.iter().map(|s| s.1).collect();
            sorted.sort_unstable_by(f64::total_cmp);
            let n = size.len();
            let share = |limit: f64| {
                let above = sorted.iter().filter(|v| **v > limit).count();
                100.0 * above as f64 / n as f64
            };
            let most = size.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            let large: Vec<&([f64; 2], f64)> = size.iter().filter(|s| s.1 > 0.3).collect();
            let among = |inside: &dyn Fn([f64; 2]) -> bool| {
                let found = large.iter().filter(|s| inside(s.0)).count();
                100.0 * found as f64 / large.len().max(1) as f64
            };
            let head = among(&|[x, y]| (x + 7.182).hypot(y - 0.312) < 4.0);
            let trochanter = among(&|[x, y]| x > 0.0 && y > -4.0);
            println!(
                "| {horizon} | {t} | {:.4} | {:.4} | {:.2} | ({:.1}, {:.1}) | {:.1} % | {:.2} % | {head:.0} %, {trochanter:.0} % |",
                sorted.iter().sum::<f64>() / n as f64,
                sorted[(n - 1) * 95 / 100],
                most.1,
                most.0[0],
                most.0[1],
                share(0.1),
                share(0.3),
            );
        }
    }
}
