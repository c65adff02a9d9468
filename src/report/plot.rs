//! Owns drawing: a figure as SVG and PNG. The only file that knows the plotting crate.
//!
//! Colours are those of Okabe and Ito (2008), which colour-blind readers tell apart; markers and dashes repeat what
//! colours say, so that a figure survives black-and-white print.

use crate::error::{Error, Result};
use crate::report::figure::{Content, Curve, Figure, GroupOfPoints, Mark, Point};
use kuva::backend::png::PngBackend;
use kuva::backend::svg::SvgBackend;
use kuva::plot::legend::LegendPosition;
use kuva::plot::line::{LinePlot, LineStyle};
use kuva::plot::scatter::{MarkerShape, ScatterPlot};
use kuva::render::layout::{Layout, TickFormat};
use kuva::render::plots::Plot;
use kuva::render::render::{Primitive, Scene, collect_legend_entries, render_multiple};

/// Okabe and Ito's palette with a brown for its yellow, which is too pale on paper.
const HUES: [&str; 8] = [
    "#0072B2", "#D55E00", "#000000", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C564B",
];

const MARKERS: [MarkerShape; 8] = [
    MarkerShape::Circle,
    MarkerShape::Square,
    MarkerShape::Diamond,
    MarkerShape::Triangle,
    MarkerShape::TriangleDown,
    MarkerShape::Pentagon,
    MarkerShape::Star,
    MarkerShape::Cross,
];

/// Markers of groups: without the diamond, which is their mean.
const GROUP_MARKERS: [MarkerShape; 6] = [
    MarkerShape::Circle,
    MarkerShape::Square,
    MarkerShape::Triangle,
    MarkerShape::TriangleDown,
    MarkerShape::Pentagon,
    MarkerShape::Star,
];

const DASHES: [&str; 4] = ["", "7 3", "2 3", "7 3 2 3"];

/// Pixels of a PNG per unit of an SVG: 560 units print 85 mm wide at 460 dots per inch.
const PNG_SCALE: f32 = 2.75;

/// A drawn figure.
pub struct Drawing {
    scene: Scene,
    /// Drawn again for pixels: their dashes are counted in pixels, and round ends make each longer.
    in_pixels: Scene,
}

impl Drawing {
    pub fn svg(&self) -> String {
        SvgBackend::new().render_scene(&self.scene)
    }

    pub fn png(&self) -> Result<Vec<u8>> {
        PngBackend::new()
            .with_scale(PNG_SCALE)
            .render_scene(&self.in_pixels)
            .map_err(|e| {
                Error::specimen(
                    format!("a figure could not be drawn: {e}"),
                    "the SVG holds the same",
                )
            })
    }
}

/// Draws a figure.
pub fn draw(figure: &Figure) -> Drawing {
    let mut in_pixels = scene(figure);
    in_pixels.elements.iter_mut().for_each(scale_dashes);
    Drawing {
        scene: scene(figure),
        in_pixels,
    }
}

fn scene(figure: &Figure) -> Scene {
    let plots: Vec<Plot> = match &figure.content {
        Content::Curves(curves) => curves.iter().flat_map(plots_of).collect(),
        Content::Groups(groups) => groups
            .iter()
            .enumerate()
            .flat_map(|(at, group)| group_plots(at as f64 + 1.0, group))
            .collect(),
    };
    let layout = layout(figure, &plots);
    render_multiple(plots, layout)
}

fn scale_dashes(element: &mut Primitive) {
    let (dashes, width) = match element {
        Primitive::Line {
            stroke_dasharray: Some(d),
            stroke_width,
            ..
        }
        | Primitive::PolyLine {
            stroke_dasharray: Some(d),
            stroke_width,
            ..
        } => (d, *stroke_width),
        Primitive::Path(path) => match &mut path.stroke_dasharray {
            Some(d) => (d, path.stroke_width),
            None => return,
        },
        _ => return,
    };
    let scale = f64::from(PNG_SCALE);
    let scaled = dashes
        .split([' ', ','])
        .enumerate()
        .filter_map(|(i, word)| {
            let length: f64 = word.parse().ok()?;
            // A round end on both sides of each dash takes from the gap after it.
            let ends = if i % 2 == 0 { -width } else { width };
            Some(format!("{:.1}", scale * (length + ends).max(0.5)))
        });
    *dashes = scaled.collect::<Vec<_>>().join(" ");
}

/// Letters of an axis of words that fit side by side.
const LABELS_FIT: usize = 58;

fn layout(figure: &Figure, plots: &[Plot]) -> Layout {
    let mut layout = Layout::auto_from_plots(plots)
        .with_width(560.0)
        .with_height(380.0)
        .with_title(figure.title.clone())
        .with_x_label(figure.x.label.clone())
        .with_y_label(figure.y.label.clone())
        .with_legend_position(LegendPosition::OutsideBottomColumns)
        // Measured names: from their letters alone the crate reserves too few rows.
        .with_legend_entries(collect_legend_entries(plots))
        .with_legend_box(false)
        .with_font_family("DejaVu Sans, Helvetica, Arial, sans-serif")
        .with_title_size(15)
        .with_label_size(13)
        .with_tick_size(12)
        .with_body_size(12);
    let words = categories(figure);
    if !words.is_empty() {
        let letters: usize = words.iter().map(|w| w.chars().count() + 2).sum();
        layout = layout
            .with_x_axis_min(0.5)
            .with_x_axis_max(words.len() as f64 + 0.5);
        if letters > LABELS_FIT {
            layout = layout.with_x_tick_rotate(-40.0);
        }
        layout = layout.with_x_categories(words);
    }
    if let Some([low, high]) = y_range(figure) {
        layout = layout.with_y_axis_min(low).with_y_axis_max(high);
    }
    // The crate's own format rounds to three digits, so that even steps look uneven.
    let ticks = |log: bool| if log { log_ticks() } else { exact_ticks() };
    if figure.x.log {
        layout = layout.with_log_x();
    }
    if figure.y.log {
        layout = layout.with_log_y();
    }
    layout = layout.with_x_tick_format(ticks(figure.x.log));
    layout = layout.with_y_tick_format(ticks(figure.y.log));
    layout
}

fn categories(figure: &Figure) -> Vec<String> {
    match &figure.content {
        Content::Groups(groups) => groups.iter().map(|g| g.label.clone()).collect(),
        Content::Curves(_) => figure.x.categories.clone(),
    }
}

/// Of a linear axis: from 0, unless values lie below, to a little above all values and their errors. None for the crate's
/// own choice.
fn y_range(figure: &Figure) -> Option<[f64; 2]> {
    let mut all = Vec::new();
    match &figure.content {
        Content::Groups(groups) => {
            for g in groups {
                all.extend(g.values.iter().copied());
                all.extend(g.mean.into_iter().flatten());
            }
        }
        Content::Curves(curves) => {
            for p in curves.iter().flat_map(|c| &c.points) {
                let [down, up] = p.y_error.unwrap_or_default();
                all.extend([p.y - down, p.y + up]);
            }
        }
    }
    let (low, high) = all
        .iter()
        .fold((0f64, 0f64), |(l, h), v| (l.min(*v), h.max(*v)));
    let usable = !figure.y.log && high > low && (high - low).is_finite();
    usable.then(|| {
        let above = if high > 0.0 { 0.06 * (high - low) } else { 0.0 };
        let below = if low < 0.0 { 0.06 * (high - low) } else { 0.0 };
        nice([low - below, high + above])
    })
}

/// Ends at round numbers, so that the axis' first and last marks are its ends.
fn nice([low, high]: [f64; 2]) -> [f64; 2] {
    let power = 10f64.powf(((high - low) / 5.0).log10().floor());
    let steps = [1.0, 2.0, 2.5, 5.0, 10.0].map(|m| m * power);
    let step = steps
        .into_iter()
        .find(|s| (high - low) / s <= 6.0)
        .unwrap_or(power);
    [(low / step).floor() * step, (high / step).ceil() * step]
}

/// 0.1, 0.2, 10, 2e4: what a reader of a log axis expects, short enough for its last label to fit.
fn log_ticks() -> TickFormat {
    TickFormat::Custom(std::sync::Arc::new(|v| match v {
        v if (1e-4..1e4).contains(&v) => format!("{}", (v * 1e6).round() / 1e6),
        v => format!("{v:e}"),
    }))
}

/// All digits of a tick of a linear axis.
fn exact_ticks() -> TickFormat {
    TickFormat::Custom(std::sync::Arc::new(|v| {
        let digits = (v * 1e8).round() / 1e8;
        // No minus before zero.
        format!("{}", digits + 0.0)
    }))
}

fn plots_of(curve: &Curve) -> Vec<Plot> {
    let hue = HUES[curve.hue % HUES.len()];
    match curve.mark {
        Mark::Joined => vec![
            Plot::Line(line(curve, hue, DASHES[curve.shape % DASHES.len()])),
            Plot::Scatter(markers(curve, hue).with_legend(curve.name.clone())),
        ],
        Mark::Points if curve.name.is_empty() => vec![Plot::Scatter(markers(curve, hue))],
        Mark::Points => vec![Plot::Scatter(
            markers(curve, hue).with_legend(curve.name.clone()),
        )],
        Mark::Rule if curve.name.is_empty() => vec![Plot::Line(line(curve, hue, "5 4"))],
        Mark::Rule => vec![Plot::Line(
            line(curve, hue, "5 4").with_legend(curve.name.clone()),
        )],
    }
}

fn pairs(points: &[Point]) -> Vec<(f64, f64)> {
    points.iter().map(|p| (p.x, p.y)).collect()
}

fn line(curve: &Curve, hue: &str, dash: &str) -> LinePlot {
    let style = match dash {
        "" => LineStyle::Solid,
        dash => LineStyle::Custom(dash.to_owned()),
    };
    LinePlot::new()
        .with_data(pairs(&curve.points))
        .with_color(hue)
        .with_stroke_width(1.5)
        .with_line_style(style)
}

fn markers(curve: &Curve, hue: &str) -> ScatterPlot {
    let errors: Vec<(f64, f64)> = curve
        .points
        .iter()
        .map(|p| p.y_error.map_or((0.0, 0.0), |[down, up]| (down, up)))
        .collect();
    let plot = ScatterPlot::new()
        .with_data(pairs(&curve.points))
        .with_color(hue)
        .with_size(4.0)
        .with_marker(MARKERS[curve.shape % MARKERS.len()]);
    match curve.points.iter().any(|p| p.y_error.is_some()) {
        true => plot.with_y_err_asymmetric(errors),
        false => plot,
    }
}

/// Half the width of a group's median, in places of the axis.
const HALF: f64 = 0.28;

/// Points side by side around the group's place, its median as a line, its mean with its interval to the right.
fn group_plots(at: f64, group: &GroupOfPoints) -> Vec<Plot> {
    let hue = HUES[group.hue % HUES.len()];
    let n = group.values.len();
    // The golden ratio spreads any number of points evenly.
    let aside = |i: usize| HALF * 0.9 * (2.0 * (0.5 + 0.618_034 * i as f64).fract() - 1.0);
    let points = (0..n).map(|i| (at + aside(i), group.values[i]));
    let mut plots = vec![Plot::Scatter(
        ScatterPlot::new()
            .with_data(points)
            .with_color(hue)
            .with_size(3.5)
            .with_marker(GROUP_MARKERS[group.hue % GROUP_MARKERS.len()]),
    )];
    if let Some(median) = group.median {
        plots.push(Plot::Line(
            LinePlot::new()
                .with_data([(at - HALF, median), (at + HALF, median)])
                .with_color("#1b1b1b")
                .with_stroke_width(2.0),
        ));
    }
    if let Some([mean, low, high]) = group.mean {
        plots.push(Plot::Scatter(
            ScatterPlot::new()
                .with_data([(at + HALF + 0.07, mean)])
                .with_color("#1b1b1b")
                .with_size(4.0)
                .with_marker(MarkerShape::Diamond)
                .with_y_err_asymmetric([(mean - low, high - mean)]),
        ));
    }
    plots
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figure::Axis;

    fn rule(dash: usize) -> Figure {
        Figure {
            x: Axis::linear("x"),
            y: Axis::linear("y"),
            content: Content::Curves(vec![Curve {
                name: "a long name that a legend must hold as a whole".to_owned(),
                hue: 0,
                shape: dash,
                mark: Mark::Joined,
                points: vec![Point::new(0.0, 1.0), Point::new(1.0, 2.0)],
            }]),
            ..Figure::default()
        }
    }

    #[test]
    fn dashes_of_pixels_are_as_long_as_those_of_vectors() {
        let dashes = |scene: &Scene| -> Vec<f64> {
            let found = scene.elements.iter().find_map(|e| match e {
                Primitive::PolyLine {
                    stroke_dasharray, ..
                }
                | Primitive::Line {
                    stroke_dasharray, ..
                } => stroke_dasharray.clone(),
                Primitive::Path(p) => p.stroke_dasharray.clone(),
                _ => None,
            });
            let found = found.expect("a dashed line");
            found.split(' ').map(|w| w.parse().unwrap()).collect()
        };
        let drawing = draw(&rule(1));
        let (svg, png) = (dashes(&drawing.scene), dashes(&drawing.in_pixels));
        let sum = |d: &[f64]| d.iter().sum::<f64>();
        assert!(
            (sum(&png) / sum(&svg) - f64::from(PNG_SCALE)).abs() < 0.05,
            "{svg:?} {png:?}"
        );
    }

    #[test]
    fn a_legend_is_whole_and_an_axis_begins_at_zero() {
        let drawing = draw(&rule(0));
        let svg = drawing.svg();
        assert!(svg.contains("a long name that a legend must hold as a whole"));
        assert_eq!(y_range(&rule(0)), Some([0.0, 2.5]));
        assert_eq!(nice([-3.0, 97.0]), [-20.0, 100.0]);
    }
}
