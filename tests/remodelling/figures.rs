//! Figures and tables of `reports/remodelling.md`, from the scenes' results under `out/` (or `$BONEPD_OUT`):
//! `cargo test --release --test all -- --ignored --nocapture remodelling_report`. Scenes that were not run are left out.

use bonepd_ct::discretisation::plane::Points;
use bonepd_ct::draw::map;
use bonepd_ct::export::points;
use bonepd_ct::report::figure::{Axis, Content, Curve, Figure, Mark, Point};
use bonepd_ct::report::plot;
use bonepd_ct::scene::Scene;
use bonepd_ct::scene::conditions::Region;
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
    last_states();
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
        x: Axis::linear("time"),
        y: Axis::linear("mean relative density change"),
        content: Content::Curves(content),
        ..Figure::default()
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

/// The picture of a scene at a time: its densities, or their difference to another scene.
fn panel(scene: &str, minus: Option<&str>, t: u32) -> Option<RgbImage> {
    let mut rows = densities(scene, t)?;
    if let Some(other) = minus {
        let other = densities(other, t)?;
        rows.iter_mut().zip(&other).for_each(|(a, b)| a.1 -= b.1);
    }
    let values: Vec<f64> = rows.iter().map(|r| r.1).collect();
    let size = if minus.is_some() { 0.3 } else { 1.0 };
    let range = map::Range {
        low: -size,
        high: size,
    };
    let full = map::draw(&points_of(&rows), &values, range, f64::from(t));
    let [w, h] = [full.width() / 2, full.height() / 2];
    Some(imageops::resize(&full, w, h, imageops::FilterType::Nearest))
}

fn points_of(rows: &[([f64; 2], f64)]) -> Points {
    let cell = |p: &[f64; 2]| p.map(|v| (v / SPACING - 0.5).round() as i32);
    Points::from_cells(
        [0.0; 2],
        SPACING,
        rows.iter().map(|(p, _)| cell(p)).collect(),
    )
}

/// Panels row by row into one picture; nothing where one is missing.
fn put_together(stem: &str, rows: &[Vec<Option<RgbImage>>]) {
    let Some(panels) = rows
        .iter()
        .map(|r| r.iter().cloned().collect())
        .collect::<Option<Vec<Vec<_>>>>()
    else {
        return;
    };
    let (w, h) = panels[0][0].dimensions();
    let mut all = RgbImage::new(w * panels[0].len() as u32, h * panels.len() as u32);
    for (j, row) in panels.iter().enumerate() {
        for (i, panel) in row.iter().enumerate() {
            imageops::replace(
                &mut all,
                panel,
                i64::from(w) * i as i64,
                i64::from(h) * j as i64,
            );
        }
    }
    map::write_png(&pictures().join(format!("{stem}.png")), &all).unwrap();
}

/// Four times side by side, of densities or of their difference to another scene.
fn sheet(scene: &str, stem: &str, minus: Option<&str>) {
    put_together(stem, &[TIMES.map(|t| panel(scene, minus, t)).to_vec()]);
}

/// As Figure 11: the last state of all models, load case 1 above load case 2.
fn last_states() {
    let rows = ["lc1", "lc2"].map(|case| {
        let scenes = kinds()
            .into_iter()
            .map(|kind| format!("femur-{case}-{kind}"));
        scenes.map(|scene| panel(&scene, None, TIMES[3])).collect()
    });
    put_together("last-states", &rows);
}

/// The continuum, then the four horizons.
fn kinds() -> Vec<String> {
    let local = ["continuum".to_owned()].into_iter();
    local
        .chain(HORIZONS.map(|h| format!("delta-{h}")))
        .collect()
}

/// Mean (5 %, 95 %) of each region at t = 10 and 280 in every scene of a load case, all points weighing alike: at the
/// continuum's nodes, too, which sit where the material points do.
fn regions(case: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join(format!("pipelines/femur-{case}-continuum.toml"));
    let scene = Scene::parse(&std::fs::read_to_string(&path).unwrap(), &path).unwrap();
    let regions = || {
        let named = scene
            .setting
            .probe
            .iter()
            .map(|p| (p.name.as_str(), p.region.clone()));
        std::iter::once(("whole", Region::All)).chain(named)
    };
    for t in [10, 280] {
        println!("\n{case}, t = {t}\n\n| | {} |", kinds().join(" | "));
        println!("|---|{}", "---|".repeat(kinds().len()));
        for (name, region) in regions() {
            let cell = |kind: &String| {
                let Some(rows) = densities(&format!("femur-{case}-{kind}"), t) else {
                    return "-".to_owned();
                };
                let chosen = region
                    .select(&points_of(&rows), rows.len(), "probe")
                    .unwrap();
                let mut values: Vec<f64> = chosen.iter().map(|&p| rows[p].1).collect();
                values.sort_unstable_by(f64::total_cmp);
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
                format!("{mean:.3} ({:.3}, {:.3})", at(0.05), at(0.95))
            };
            let row: Vec<String> = kinds().iter().map(cell).collect();
            println!("| {name} | {} |", row.join(" | "));
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
