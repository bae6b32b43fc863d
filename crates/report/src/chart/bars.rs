//! Stacked bars.

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};
use serde::{Deserialize, Serialize};

use super::canvas::{self, Area, Glyph, LegendEntry, message, style_mesh, text_style, text_width_px};
use super::ruler::Ruler;
use super::{Axis, Palette};
use crate::ReportError;
use crate::table::format_number;

const BAR_PITCH_PX: u32 = 34;
const AXIS_HEIGHT_PX: u32 = 66;
/// Half the height of a bar, of a pitch of 1.
const HALF_BAR: f64 = 0.34;
/// Longer names are cut.
const GREATEST_NAME_PX: i32 = 240;

type Plot<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<Ruler, RangedCoordf64>>;

/// A part of every bar.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stage {
    /// The name in the legend; a name has the same colour in all charts.
    pub name: String,
    /// One value a bar, none below 0.
    pub values: Vec<f64>,
}

/// Horizontal bars of parts that add up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BarChart {
    /// The title, unique in the report.
    pub name: String,
    /// A note for readers; may be empty.
    #[serde(default)]
    pub note: String,
    /// The axis of the bars' lengths. Lengths add up, so its scale is linear.
    pub value: Axis,
    /// Names of the bars, top to bottom.
    pub bars: Vec<String>,
    /// Parts, left to right.
    pub stages: Vec<Stage>,
}

impl BarChart {
    /// A chart of bars without parts.
    #[must_use]
    pub fn new(name: impl Into<String>, value: Axis, bars: impl IntoIterator<Item = impl Into<String>>) -> Self {
        let bars = bars.into_iter().map(Into::into).collect();
        Self { name: name.into(), note: String::new(), value, bars, stages: Vec::new() }
    }

    /// The same chart with one more part in every bar. Values that are not finite or below 0 count as 0.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        let values = values.into_iter().map(|value| if value.is_finite() { value.max(0.0) } else { 0.0 });
        self.stages.push(Stage { name: name.into(), values: values.collect() });
        self
    }

    pub(super) fn draw(&self, palette: &Palette) -> Result<String, ReportError> {
        self.validate()?;
        let names = self.stages.iter().map(|stage| stage.name.clone());
        let legend = names.map(|text| LegendEntry { glyph: Glyph::Swatch(palette.color(&text)), text });
        let legend: Vec<LegendEntry> = legend.collect();
        let height_px = AXIS_HEIGHT_PX + BAR_PITCH_PX * self.bars.len().max(1) as u32;
        canvas::draw(&self.name, &legend, height_px, |area| self.draw_plot(area, palette))
    }

    fn validate(&self) -> Result<(), ReportError> {
        match self.stages.iter().find(|stage| stage.values.len() != self.bars.len()) {
            Some(stage) => Err(ReportError::StageLength {
                chart: self.name.clone(),
                stage: stage.name.clone(),
                values: stage.values.len(),
                bars: self.bars.len(),
            }),
            None => Ok(()),
        }
    }

    fn total(&self, bar: usize) -> f64 {
        self.stages.iter().map(|stage| stage.values[bar]).sum()
    }

    fn draw_plot(&self, area: &Area, palette: &Palette) -> Result<(), String> {
        let mut plot = self.axes(area)?;
        plot.draw_series(self.parts(palette)).map_err(message)?;
        self.draw_texts(area, &plot)
    }

    fn axes<'a>(&self, area: &Area<'a>) -> Result<Plot<'a>, String> {
        let names_px = self.bars.iter().map(|name| text_width_px(name)).max().unwrap_or(0).min(GREATEST_NAME_PX);
        let values = self.ruler();
        let tick_count = values.tick_count();
        let mut plot = ChartBuilder::on(area)
            .margin_left(14)
            .margin_right(14)
            .margin_bottom(6)
            .x_label_area_size(46)
            .y_label_area_size(names_px + 12)
            .build_cartesian_2d(values, 0.0..self.bars.len().max(1) as f64)
            .map_err(message)?;
        let mut mesh = plot.configure_mesh();
        mesh.x_desc(self.value.description()).x_labels(tick_count).disable_y_mesh().y_labels(0);
        style_mesh(&mut mesh);
        mesh.draw().map_err(message)?;
        Ok(plot)
    }

    /// From 0 to beyond the longest bar, with room for its total.
    fn ruler(&self) -> Ruler {
        let greatest = (0..self.bars.len()).map(|bar| self.total(bar)).fold(0.0, f64::max);
        let end = if greatest > 0.0 { greatest * 1.13 } else { 1.0 };
        Ruler::new(&Axis::linear(&self.value.label, &self.value.unit), 0.0..end)
    }

    /// The middle of a bar: the first is at the top.
    fn middle(&self, bar: usize) -> f64 {
        (self.bars.len() - bar) as f64 - 0.5
    }

    fn parts(&self, palette: &Palette) -> Vec<Rectangle<(f64, f64)>> {
        let mut ends = vec![0.0; self.bars.len()];
        let mut parts = Vec::new();
        for stage in &self.stages {
            let style = palette.color(&stage.name).filled();
            for (bar, (&value, end)) in
                stage.values.iter().zip(&mut ends).enumerate().filter(|(_, (value, _))| **value > 0.0)
            {
                let start = *end;
                let y = self.middle(bar);
                *end += value;
                parts.push(Rectangle::new([(start, y - HALF_BAR), (*end, y + HALF_BAR)], style));
            }
        }
        parts
    }

    /// Names stand to the left of the bars, totals to the right.
    fn draw_texts(&self, area: &Area, plot: &Plot) -> Result<(), String> {
        let (left_px, top_px) = area.get_base_pixel();
        for (bar, name) in self.bars.iter().enumerate() {
            let total = self.total(bar);
            let texts = [(0.0, -8, cut(name), HPos::Right), (total, 6, format_number(total), HPos::Left)];
            for (value, offset_px, text, anchor) in texts {
                let (x, y) = plot.backend_coord(&(value, self.middle(bar)));
                let at = (x - left_px + offset_px, y - top_px);
                area.draw(&Text::new(text, at, text_style(anchor, VPos::Center))).map_err(message)?;
            }
        }
        Ok(())
    }
}

/// A name that fits beside its bar.
fn cut(name: &str) -> String {
    let letters: Vec<char> = name.chars().collect();
    let shorter = (0..letters.len()).rev().map(|count| letters[..count].iter().collect::<String>() + "…");
    let mut texts = std::iter::once(name.to_owned()).chain(shorter);
    texts.find(|text| text_width_px(text) <= GREATEST_NAME_PX).unwrap_or_default()
}
