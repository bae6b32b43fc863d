//! Lines and points over two axes.

use std::ops::Range;

use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};
use serde::{Deserialize, Serialize};

use super::canvas::{self, INK, LegendEntry, TEXT_SIZE, WIDTH_PX, message, text_style, text_width_px};
use super::marker::{Area, Marker};
use super::ruler::Ruler;
use super::{Axis, Limit, Mark, Palette, Point, Series};
use crate::ReportError;
use crate::table::heading;

/// Series over two axes, written as `charts/{slug(name)}.svg`, optionally with limits to reach and a front of the best points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename = "xy")]
pub struct XyChart {
    /// The title, unique in the report.
    pub name: String,
    /// A note for readers; may be empty.
    #[serde(default)]
    pub note: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// Series, in drawing order.
    pub series: Vec<Series>,
    /// Horizontal lines.
    #[serde(default)]
    pub limits: Vec<Limit>,
    /// Points that a staircase joins from left to right, such as a Pareto front.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub staircase: Vec<Point>,
}

type Plot<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<Ruler, Ruler>>;

impl XyChart {
    /// A chart without series.
    #[must_use]
    pub fn new(name: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self {
            name: name.into(),
            note: String::new(),
            x,
            y,
            series: Vec::new(),
            limits: Vec::new(),
            staircase: Vec::new(),
        }
    }

    /// The same chart with one more series.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// The chart alone as SVG.
    ///
    /// # Errors
    /// The chart cannot be drawn.
    pub fn to_svg(&self) -> Result<String, ReportError> {
        self.draw(&Palette::for_names(self.series.iter().map(|series| series.name.as_str())))
    }

    /// The chart as SVG, in the palette's colours.
    pub(crate) fn draw(&self, palette: &Palette) -> Result<String, ReportError> {
        let legend: Vec<LegendEntry> = self.series.iter().flat_map(|series| legend_entries(series, palette)).collect();
        canvas::draw(&self.name, &legend, |area| self.draw_plot(area, palette))
    }

    fn draw_plot(&self, area: &Area, palette: &Palette) -> Result<(), String> {
        let (x_range, y_range) = self.ranges();
        let mut plot = self.axes(area, x_range.clone(), y_range)?;
        for limit in &self.limits {
            self.draw_limit(&mut plot, limit, &x_range)?;
        }
        let corners = staircase(&self.staircase.iter().filter_map(|point| self.place(point)).collect::<Vec<_>>());
        draw_path(&mut plot, corners, INK.mix(0.35).stroke_width(2), false)?;
        self.series.iter().try_for_each(|series| self.draw_series(&mut plot, series, palette))?;
        self.draw_labels(&mut plot, &x_range)
    }

    /// Both axes' ranges, in axis space.
    fn ranges(&self) -> (Range<f64>, Range<f64>) {
        let points = self.series.iter().flat_map(|series| &series.points);
        let points = points.filter(|point| self.place(point).is_some());
        let limits = self.limits.iter().map(|limit| limit.y);
        let x_range = self.x.range(points.clone().map(|point| point.x));
        (x_range, self.y.range(points.map(|point| point.y).chain(limits)))
    }

    /// A point in axis space; `None` where an axis cannot show it.
    fn place(&self, point: &Point) -> Option<(f64, f64)> {
        Some((self.x.place(point.x)?, self.y.place(point.y)?))
    }

    fn axes<'a>(&self, area: &Area<'a>, x: Range<f64>, y: Range<f64>) -> Result<Plot<'a>, String> {
        let x = Ruler::new(&self.x, x);
        let y = Ruler::new(&self.y, y);
        let x_count = x.ticks.len();
        let y_count = y.ticks.len();
        let mut plot = ChartBuilder::on(area)
            .margin_right(18)
            .margin_top(6)
            .margin_left(8)
            .margin_bottom(6)
            .x_label_area_size(48)
            .y_label_area_size(66)
            .build_cartesian_2d(x, y)
            .map_err(message)?;
        let mut mesh = plot.configure_mesh();
        mesh.x_desc(heading(&self.x.label, &self.x.unit))
            .y_desc(heading(&self.y.label, &self.y.unit))
            .x_labels(x_count)
            .y_labels(y_count);
        mesh.axis_style(INK.mix(0.6)).bold_line_style(INK.mix(0.13)).light_line_style(TRANSPARENT);
        mesh.label_style(("sans-serif", 15).into_font().color(&INK));
        mesh.axis_desc_style(("sans-serif", TEXT_SIZE).into_font().color(&INK));
        mesh.draw().map_err(message)?;
        Ok(plot)
    }

    fn draw_limit(&self, plot: &mut Plot, limit: &Limit, x: &Range<f64>) -> Result<(), String> {
        let Some(y) = self.y.place(limit.y) else { return Ok(()) };
        let style = INK.mix(0.55).stroke_width(1);
        draw_path(plot, vec![(x.start, y), (x.end, y)], style, true)?;
        let text = EmptyElement::at((x.end, y))
            + Text::new(limit.name.clone(), (-4, -3), text_style(HPos::Right, VPos::Bottom));
        plot.draw_series([text]).map(drop).map_err(message)
    }

    fn draw_series(&self, plot: &mut Plot, series: &Series, palette: &Palette) -> Result<(), String> {
        let places: Vec<(usize, (f64, f64))> =
            series.points.iter().enumerate().filter_map(|(index, point)| Some((index, self.place(point)?))).collect();
        let style = palette.color(&series.name).stroke_width(2);
        if series.mark == Mark::Line {
            let measured = places.iter().filter(|(index, _)| !series.is_extrapolated(*index));
            draw_path(plot, measured.map(|(_, place)| *place).collect(), style, false)?;
            // The line starts at the last measured point, so that it does not break.
            let extrapolated = places.iter().filter(|(index, _)| series.is_extrapolated(index + 1));
            draw_path(plot, extrapolated.map(|(_, place)| *place).collect(), style, true)?;
        }
        let pixels = plot.plotting_area().strip_coord_spec();
        let (left_px, top_px) = pixels.get_base_pixel();
        places.iter().try_for_each(|(index, place)| {
            let (x, y) = plot.backend_coord(place);
            marker(series, palette, !series.is_extrapolated(*index)).draw(&pixels, x - left_px, y - top_px)
        })
    }

    /// Labels stand to the right of their points, or to the left near the right edge.
    /// Labels of points on the staircase go before others, and those of later series, which lie on top, before those of earlier ones. A
    /// label that would cover one before it is left out.
    fn draw_labels(&self, plot: &mut Plot, x: &Range<f64>) -> Result<(), String> {
        let labelled =
            self.series.iter().rev().flat_map(|series| &series.points).filter(|point| !point.label.is_empty());
        let mut labelled: Vec<&Point> = labelled.collect();
        labelled.sort_by_key(|point| !self.staircase.iter().any(|corner| corner.x == point.x && corner.y == point.y));
        let mut drawn: Vec<(Range<i32>, i32)> = Vec::new();
        let mut texts = Vec::new();
        for point in labelled {
            let Some(place) = self.place(point) else { continue };
            let width_px = text_width_px(&point.label);
            let right_of_px = (x.end - place.0) / (x.end - x.start) * f64::from(WIDTH_PX - 100);
            let fits = f64::from(width_px + 12) < right_of_px;
            let (x_px, y_px) = plot.backend_coord(&place);
            let first_px = if fits { x_px + 9 } else { x_px - 9 - width_px };
            let columns_px = first_px..first_px + width_px;
            let is_covered = drawn.iter().any(|(other, other_y_px)| {
                let beside = columns_px.end <= other.start || other.end <= columns_px.start;
                !beside && (y_px - other_y_px).abs() < TEXT_SIZE
            });
            if is_covered {
                continue;
            }
            drawn.push((columns_px, y_px));
            let (offset, anchor) = if fits { (9, HPos::Left) } else { (-9, HPos::Right) };
            texts.push(
                EmptyElement::at(place)
                    + Text::new(point.label.clone(), (offset, -8), text_style(anchor, VPos::Center)),
            );
        }
        plot.draw_series(texts).map(drop).map_err(message)
    }
}

fn marker(series: &Series, palette: &Palette, filled: bool) -> Marker {
    Marker { shape: palette.slot(&series.name), color: palette.color(&series.name), filled }
}

/// Legend entries: one for measured points, one for extrapolated ones.
fn legend_entries(series: &Series, palette: &Palette) -> Vec<LegendEntry> {
    let measured = (series.extrapolated_from != Some(0)).then(|| (series.name.clone(), true));
    let extrapolated = series.extrapolated_from.map(|_| (format!("{}, extrapolated", series.name), false));
    let entries = measured.into_iter().chain(extrapolated).map(|(text, filled)| LegendEntry {
        text,
        marker: marker(series, palette, filled),
        mark: series.mark,
    });
    entries.collect()
}

fn draw_path(plot: &mut Plot, points: Vec<(f64, f64)>, style: ShapeStyle, dashed: bool) -> Result<(), String> {
    if points.len() < 2 {
        return Ok(());
    }
    let drawn = match dashed {
        true => plot.draw_series([DashedPathElement::new(points, 6, 5, style)]).map(drop),
        false => plot.draw_series([PathElement::new(points, style)]).map(drop),
    };
    drawn.map_err(message)
}

/// A front is a staircase: nothing between two of its points has been reached.
fn staircase(front: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let steps = front.windows(2).flat_map(|pair| [pair[0], (pair[1].0, pair[0].1)]);
    steps.chain(front.last().copied()).collect()
}
