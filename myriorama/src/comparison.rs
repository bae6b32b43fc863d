//! Written views beside the same views drawn directly.

use std::path::Path;

use anyhow::Context as _;
use depth_image::View;
use metrics::{PictureErrors, Rgb8Image};
use report::{Cell, Table};

/// Errors over the foreground, then over the whole picture.
pub type Row = [f64; 6];

const COLUMNS: [(&str, &str); 7] = [
    ("view", ""),
    ("foreground PSNR", "dB"),
    ("foreground SSIM", ""),
    ("foreground FLIP", ""),
    ("PSNR", "dB"),
    ("SSIM", ""),
    ("FLIP", ""),
];

/// A table with a row for each view, by number, then the mean and the worst of each column.
///
/// # Errors
/// The table refuses a value.
pub fn table(mut rows: Vec<(usize, Row)>) -> anyhow::Result<Table> {
    let mut table = Table::new("Against views drawn directly", &COLUMNS);
    rows.sort_by_key(|(number, _)| *number);
    let columns: [Vec<f64>; 6] = std::array::from_fn(|column| rows.iter().map(|(_, row)| row[column]).collect());
    let means = columns.each_ref().map(|numbers| numbers.iter().sum::<f64>() / rows.len() as f64);
    let worst = std::array::from_fn(|column| match column {
        // FLIP is an error, and the others are likenesses.
        2 | 5 => columns[column].iter().copied().fold(f64::NEG_INFINITY, f64::max),
        _ => columns[column].iter().copied().fold(f64::INFINITY, f64::min),
    });
    let views = rows.iter().map(|(number, row)| (Cell::from(*number), *row));
    for (name, numbers) in views.chain([("mean".into(), means), ("worst".into(), worst)]) {
        table.push([name].into_iter().chain(numbers.map(Cell::from)))?;
    }
    Ok(table)
}

/// PSNR, SSIM and FLIP of a written picture, against a view with depth.
///
/// # Errors
/// The picture cannot be read, or has another size.
pub fn row(truth: &View, written: &Path) -> anyhow::Result<Row> {
    let picture = image::open(written).with_context(|| format!("cannot read {}", written.display()))?.into_rgb8();
    let test = Rgb8Image::new(picture.width(), picture.height(), picture.as_raw().as_slice())?;
    let [foreground, whole] = PictureErrors::of(truth, &test)?;
    Ok([foreground.psnr_db, foreground.ssim, foreground.flip, whole.psnr_db, whole.ssim, whole.flip])
}
