//! Owns drawing: a figure as SVG and PNG. The only file that knows the plotting crate.
//!
//! Colours are those of Okabe and Ito (2008), which colour-blind readers tell apart; markers and dashes repeat what
//! colours say, so that a figure survives black-and-white print.

use crate::error::{Error, Result};
use crate::report::figure::{Content, Curve, Figure, Mark, Point};
use kuva::backend::png::PngBackend;
use kuva::backend::svg::SvgBackend;
use kuva::plot::boxplot::BoxPlot;
use kuva::plot::legend::LegendPosition;
use kuva::plot::line::{LinePlot, LineStyle};
use kuva::plot::scatter::{MarkerShape, ScatterPlot};
use kuva::render::layout::{Layout, TickFormat};
use kuva::render::plots::Plot;
use kuva::render::render::{Scene, render_multiple};

/// Okabe and Ito's palette without its yellow, which is too pale on paper.
const HUES: [&str; 7] = [
    "#0072B2", "#D55E00", "#000000", "#009E73", "#CC79A7", "#E69F00", "#56B4E9",
];

const MARKERS: [MarkerShape; 7] = [
    MarkerShape::Circle,
    MarkerShape::Square,
    MarkerShape::Diamond,
    MarkerShape::Triangle,
    MarkerShape::TriangleDown,
    MarkerShape::Pentagon,
    MarkerShape::Star,
];

const DASHES: [&str; 4] = ["", "7 3", "2 3", "7 3 2 3"];

/// Pixels of a PNG per unit of an SVG: 560 units print 85 mm wide at 460 dots per inch.
const PNG_SCALE: f32 = 2.75;

/// A drawn figure.
pub struct Drawing(Scene);

impl Drawing {
    pub fn svg(&self) -> String {
        SvgBackend::new().render_scene(&self.0)
    }

    pub fn png(&self) -> Result<Vec<u8>> {
        PngBackend::new()
            .with_scale(PNG_SCALE)
            .render_scene(&self.0)
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
    let plots = match &figure.content {
        Content::Curves(curves) => curves.iter().flat_map(plots_of).collect(),
        Content::Boxes(boxes) => vec![boxplot(boxes)],
    };
    let layout = layout(figure, &plots);
    Drawing(render_multiple(plots, layout))
}

fn layout(figure: &Figure, plots: &[Plot]) -> Layout {
    let mut layout = Layout::auto_from_plots(plots)
        .with_width(560.0)
        .with_height(380.0)
        .with_title(figure.title.clone())
        .with_x_label(figure.x.label.clone())
        .with_y_label(figure.y.label.clone())
        .with_legend_position(LegendPosition::OutsideRightTop)
        .with_legend_box(false)
        .with_font_family("DejaVu Sans, Helvetica, Arial, sans-serif")
        .with_title_size(15)
        .with_label_size(13)
        .with_tick_size(12)
        .with_body_size(12);
    if let Content::Boxes(boxes) = &figure.content {
        // Whiskers leave outliers outside the axis that the crate would choose.
        let values = boxes.iter().flat_map(|(_, values)| values);
        let (low, high) = values.fold((0.0f64, 0.0f64), |(low, high), v| {
            (low.min(*v), high.max(*v))
        });
        layout = layout
            .with_y_axis_min(1.05 * low)
            .with_y_axis_max(1.05 * high);
    }
    if figure.x.log {
        layout = layout.with_log_x().with_x_tick_format(plain_ticks());
    }
    if figure.y.log {
        layout = layout.with_log_y().with_y_tick_format(plain_ticks());
    }
    layout
}

/// 0.1, 0.2, 10: what a reader of a log axis expects.
fn plain_ticks() -> TickFormat {
    TickFormat::Custom(std::sync::Arc::new(|v| match v {
        v if (1e-4..1e6).contains(&v) => format!("{}", (v * 1e6).round() / 1e6),
        v => format!("{v:e}"),
    }))
}

fn plots_of(curve: &Curve) -> Vec<Plot> {
    let hue = HUES[curve.hue % HUES.len()];
    match curve.mark {
        Mark::Joined => vec![
            Plot::Line(line(curve, hue, DASHES[curve.shape % DASHES.len()])),
            Plot::Scatter(markers(curve, hue).with_legend(curve.name.clone())),
        ],
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

/// Pale boxes, so that the scans' points show on them.
fn boxplot(boxes: &[(String, Vec<f64>)]) -> Plot {
    let plot = boxes.iter().fold(BoxPlot::new(), |plot, (label, values)| {
        plot.with_group(label.clone(), values.clone())
    });
    Plot::Box(
        plot.with_color("#9dbcd4")
            .with_swarm_overlay()
            .with_overlay_color("#1b1b1b")
            .with_overlay_size(2.5),
    )
}
