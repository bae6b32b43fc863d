//! Written views beside the same views drawn directly.

use std::path::Path;

use anyhow::Context as _;
use depth_image::View;
use image::ImageReader;
use metrics::{Rgb8Image, ScoreMap, flip_map, psnr_db, ssim_map};
use table::{Cell, Table};

/// A table with a row a view, by number, the mean and the worst of each column; and the worst PSNR.
///
/// # Errors
/// The table refuses a value.
pub fn table(mut rows: Vec<(usize, [f64; 3])>) -> anyhow::Result<(Table, f64)> {
    let columns = [("view", ""), ("PSNR", "dB"), ("SSIM", ""), ("FLIP", "")];
    let mut table = Table::new("Against views drawn directly", &columns);
    rows.sort_by_key(|(number, _)| *number);
    let of = |column: usize| rows.iter().map(move |(_, row)| row[column]);
    let means = [0, 1, 2].map(|column| of(column).sum::<f64>() / rows.len() as f64);
    let [psnr_db, ssim] = [0, 1].map(|column| of(column).fold(f64::INFINITY, f64::min));
    let worst = [psnr_db, ssim, of(2).fold(f64::NEG_INFINITY, f64::max)];
    let views = rows.iter().map(|(number, row)| (Cell::from(*number), *row));
    for (name, numbers) in views.chain([("mean".into(), means), ("worst".into(), worst)]) {
        table.push([name].into_iter().chain(numbers.map(Cell::from)))?;
    }
    Ok((table, psnr_db))
}

/// PSNR, SSIM and FLIP of a written picture.
///
/// # Errors
/// The picture cannot be read, or has another size.
pub fn row(truth: &View, written: &Path) -> anyhow::Result<[f64; 3]> {
    let read = || anyhow::Ok(ImageReader::open(written)?.decode()?.into_rgb8());
    let picture = read().with_context(|| format!("cannot read {}", written.display()))?;
    let (reference, test) =
        (Rgb8Image::of_view(truth)?, Rgb8Image::new(picture.width(), picture.height(), picture.as_raw().as_slice())?);
    let psnr_db = psnr_db(&reference, &test, None)?.unwrap_or(f64::NAN).min(metrics::PSNR_CAP_DB);
    Ok([psnr_db, mean(&ssim_map(&reference, &test)?)?, mean(&flip_map(&reference, &test)?)?])
}

fn mean(map: &ScoreMap) -> anyhow::Result<f64> {
    Ok(map.mean(None)?.unwrap_or(f64::NAN))
}
