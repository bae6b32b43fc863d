//! The frame of all charts: a title, a legend above the data, and ink that follows the page.

use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::Mark;
use super::marker::{Area, Marker};
use crate::ReportError;

/// Charts are drawn at this width and may be scaled.
pub(super) const WIDTH_PX: u32 = 700;
/// Size of texts in the chart library's unit, 1.24 of a CSS pixel.
pub(super) const TEXT_SIZE: i32 = 16;
/// About the width of a sans-serif letter at that size.
const LETTER_WIDTH_PX: f64 = 7.4;
const PLOT_HEIGHT_PX: u32 = 390;
const TITLE_HEIGHT_PX: i32 = 30;
const LEGEND_ROW_PX: i32 = 22;
const MARGIN_PX: i32 = 14;
/// The distance from a legend's glyph to its text.
const GLYPH_WIDTH_PX: i32 = 34;

/// A stand-in for the page's text colour, replaced by `currentColor` at the end.
pub(super) const INK: RGBColor = RGBColor(1, 2, 3);
const INK_IN_SVG: &str = "#010203";

/// An entry of a legend.
pub(super) struct LegendEntry {
    pub(super) text: String,
    /// A measured point's marker is filled, and an extrapolated line is dashed.
    pub(super) marker: Marker,
    pub(super) mark: Mark,
}

/// Draws title and legend, and the rest by `plot` in the area below them. The SVG has no paper, and the ink of
/// the page that it is on.
pub(super) fn draw(
    name: &str,
    legend: &[LegendEntry],
    plot: impl FnOnce(&Area) -> Result<(), String>,
) -> Result<String, ReportError> {
    let rows = legend_rows(legend);
    let header_px = TITLE_HEIGHT_PX + LEGEND_ROW_PX * rows.len() as i32 + 4;
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH_PX, header_px as u32 + PLOT_HEIGHT_PX)).into_drawing_area();
        let (header, below) = area.split_vertically(header_px);
        let drawn = draw_header(&header, name, &rows)
            .and_then(|()| plot(&below))
            .and_then(|()| area.present().map_err(message));
        drawn.map_err(|message| ReportError::Draw { chart: name.into(), message })?;
    }
    let described = format!("<svg role=\"img\" aria-label=\"{}\" ", minijinja::HtmlEscape(name));
    Ok(svg.replace(INK_IN_SVG, "currentColor").replacen("<svg ", &described, 1))
}

/// The text of an error of the chart library, which borrows the drawing.
pub(super) fn message(error: impl std::error::Error) -> String {
    error.to_string()
}

/// Text in the page's ink.
pub(super) fn text_style(horizontal: HPos, vertical: VPos) -> TextStyle<'static> {
    TextStyle::from(("sans-serif", TEXT_SIZE).into_font()).color(&INK).pos(Pos::new(horizontal, vertical))
}

/// The width of a text, about.
pub(super) fn text_width_px(text: &str) -> i32 {
    (text.chars().count() as f64 * LETTER_WIDTH_PX).ceil() as i32
}

/// Entries in rows, with as many a row as fit.
fn legend_rows(legend: &[LegendEntry]) -> Vec<Vec<(i32, &LegendEntry)>> {
    let mut rows: Vec<Vec<(i32, &LegendEntry)>> = Vec::new();
    let mut next_px = i32::MAX;
    for entry in legend {
        let width = GLYPH_WIDTH_PX + text_width_px(&entry.text) + 18;
        if next_px.saturating_add(width) > WIDTH_PX as i32 - MARGIN_PX {
            rows.push(Vec::new());
            next_px = MARGIN_PX;
        }
        if let Some(row) = rows.last_mut() {
            row.push((next_px, entry));
        }
        next_px += width;
    }
    rows
}

fn draw_header(area: &Area, name: &str, rows: &[Vec<(i32, &LegendEntry)>]) -> Result<(), String> {
    let title = TextStyle::from(("sans-serif", 19).into_font().style(FontStyle::Bold)).color(&INK);
    area.draw(&Text::new(name.to_owned(), (MARGIN_PX, 9), title)).map_err(message)?;
    for (row, entries) in rows.iter().enumerate() {
        let y = TITLE_HEIGHT_PX + LEGEND_ROW_PX * row as i32 + LEGEND_ROW_PX / 2;
        entries.iter().try_for_each(|(x, entry)| draw_entry(area, *x, y, entry))?;
    }
    Ok(())
}

fn draw_entry(area: &Area, x: i32, y: i32, entry: &LegendEntry) -> Result<(), String> {
    let line = [(x, y), (x + GLYPH_WIDTH_PX - 8, y)];
    let middle_x = x + GLYPH_WIDTH_PX / 2 - 4;
    let style = entry.marker.color.stroke_width(2);
    match (entry.mark, entry.marker.filled) {
        (Mark::Points, _) => (),
        (Mark::Line, true) => area.draw(&PathElement::new(line.to_vec(), style)).map_err(message)?,
        (Mark::Line, false) => area.draw(&DashedPathElement::new(line, 5, 4, style)).map_err(message)?,
    }
    entry.marker.draw(area, middle_x, y)?;
    let text = Text::new(entry.text.clone(), (x + GLYPH_WIDTH_PX, y), text_style(HPos::Left, VPos::Center));
    area.draw(&text).map_err(message)
}
