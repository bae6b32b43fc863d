//! Text of a terminal as an SVG picture.

use std::fmt::Write as _;

/// The size of one character, in pixels; rows stand a little apart.
const CHARACTER_PX: (f64, f64) = (7.8, 18.0);
const MARGIN_PX: f64 = 14.0;
/// The columns of a row; longer lines are wrapped.
const COLUMNS: usize = 124;

/// An SVG picture of lines of text.
#[must_use]
pub fn svg(text: &str) -> String {
    let rows: Vec<String> = text.lines().flat_map(wrapped).collect();
    let columns = rows.iter().map(|row| row.chars().count()).max().unwrap_or(0);
    let (width_px, height_px) =
        (columns as f64 * CHARACTER_PX.0 + 2.0 * MARGIN_PX, rows.len() as f64 * CHARACTER_PX.1 + 2.0 * MARGIN_PX);
    let mut picture = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width_px:.0} {height_px:.0}\" width=\"{width_px:.0}\" \
         height=\"{height_px:.0}\">\n<rect width=\"100%\" height=\"100%\" rx=\"8\" fill=\"#16181d\"/>\n\
         <g font-family=\"ui-monospace, DejaVu Sans Mono, monospace\" font-size=\"13\" fill=\"#d8dee9\" \
         xml:space=\"preserve\">\n"
    );
    for (number, row) in rows.iter().enumerate() {
        let y_px = MARGIN_PX + (number as f64 + 0.8) * CHARACTER_PX.1;
        // Writing to a string does not fail.
        let _ = writeln!(picture, "<text x=\"{MARGIN_PX}\" y=\"{y_px:.1}\">{}</text>", escaped(row));
    }
    picture + "</g>\n</svg>\n"
}

/// Wraps a line at spaces.
fn wrapped(line: &str) -> Vec<String> {
    let (mut rows, mut row) = (Vec::new(), String::new());
    for word in line.split_inclusive(' ') {
        if row.chars().count() + word.trim_end().chars().count() > COLUMNS && !row.is_empty() {
            rows.push(std::mem::take(&mut row));
        }
        row.push_str(word);
    }
    rows.push(row);
    rows
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_is_drawn_and_long_lines_are_wrapped() {
        let long = "word ".repeat(60);
        let picture = svg(&format!("a < b & c\n\n{long}"));
        assert!(picture.contains("a &lt; b &amp; c"));
        assert_eq!(picture.matches("<text").count(), 2 + 3, "{picture}");
        assert_eq!(picture.matches("word").count(), 60);
    }
}
