//! Markers of points: each series has a shape as well as a colour.

use plotters::coord::Shift;
use plotters::prelude::*;

/// Part of a drawing.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Half a marker's size in pixels.
const RADIUS_PX: i32 = 4;

/// A shape centred on a point.
#[derive(Clone, Copy)]
pub(super) struct Marker {
    /// Circle, square, diamond, triangle.
    pub(super) shape: usize,
    pub(super) color: RGBColor,
    /// True for measured points, false for extrapolated ones.
    pub(super) filled: bool,
}

impl Marker {
    /// Draws it at a pixel of the area.
    pub(super) fn draw(self, area: &Area, x: i32, y: i32) -> Result<(), String> {
        let style = ShapeStyle { color: self.color.to_rgba(), filled: self.filled, stroke_width: 2 };
        let corners = self.corners().map(|(dx, dy)| (x + dx, y + dy));
        match (self.shape % 4, self.filled) {
            (0, _) => area.draw(&Circle::new((x, y), RADIUS_PX, style)),
            (_, true) => area.draw(&Polygon::new(corners.to_vec(), style)),
            (_, false) => area.draw(&PathElement::new([corners.as_slice(), &corners[..1]].concat(), style)),
        }
        .map_err(|error| error.to_string())
    }

    /// Offsets from the centre. A triangle's first corner counts twice.
    fn corners(self) -> [(i32, i32); 4] {
        let small = RADIUS_PX - 1;
        let large = RADIUS_PX + 1;
        match self.shape % 4 {
            1 => [(-small, -small), (small, -small), (small, small), (-small, small)],
            2 => [(0, -large), (large, 0), (0, large), (-large, 0)],
            _ => [(0, -large), (0, -large), (RADIUS_PX, small), (-RADIUS_PX, small)],
        }
    }
}
