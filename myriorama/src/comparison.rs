//! Written views beside the same views drawn directly.

use std::path::Path;

use anyhow::Context as _;
use depth_image::View;
use image::ImageReader;
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
    let of = |column: usize| rows.iter().map(move |(_, row)| row[column]);
    let means = [0, 1, 2, 3, 4, 5].map(|column| of(column).sum::<f64>() / rows.len() as f64);
    let least = |column| of(column).fold(f64::INFINITY, f64::min);
    let most = |column| of(column).fold(f64::NEG_INFINITY, f64::max);
    let worst = [least(0), least(1), most(2), least(3), least(4), most(5)];
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
    let read = || anyhow::Ok(ImageReader::open(written)?.decode()?.into_rgb8());
    let picture = read().with_context(|| format!("cannot read {}", written.display()))?;
    let test = Rgb8Image::new(picture.width(), picture.height(), picture.as_raw().as_slice())?;
    let [foreground, whole] = PictureErrors::of(truth, &test)?;
    let three = |PictureErrors { psnr_db, ssim, flip }| [psnr_db, ssim, flip];
    let [[a, b, c], [d, e, f]] = [three(foreground), three(whole)];
    Ok([a, b, c, d, e, f])
}
