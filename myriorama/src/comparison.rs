//! Delivered views beside the same views drawn directly.

use client::Frame;
use metrics::{Rgb8Image, ScoreMap, flip_map, psnr_db, ssim_map};
use table::{Cell, Table};

/// A table with a row a view, the mean and the worst of each column; and the worst PSNR.
///
/// # Errors
/// Views differ in size.
pub fn table(truth: &[Frame], delivered: &[Frame]) -> anyhow::Result<(Table, f64)> {
    let columns = [("view", ""), ("PSNR", "dB"), ("SSIM", ""), ("FLIP", "")];
    let mut table = Table::new("Against views drawn directly", &columns);
    let rows = truth.iter().zip(delivered).map(row).collect::<anyhow::Result<Vec<_>>>()?;
    let of = |column: usize| rows.iter().map(move |row| row[column]);
    let means = [0, 1, 2].map(|column| of(column).sum::<f64>() / rows.len() as f64);
    let [psnr_db, ssim] = [0, 1].map(|column| of(column).fold(f64::INFINITY, f64::min));
    let worst = [psnr_db, ssim, of(2).fold(f64::NEG_INFINITY, f64::max)];
    let views = rows.iter().enumerate().map(|(number, row)| (Cell::from(number), *row));
    for (name, numbers) in views.chain([("mean".into(), means), ("worst".into(), worst)]) {
        table.push([name].into_iter().chain(numbers.map(Cell::from)))?;
    }
    Ok((table, psnr_db))
}

/// PSNR, SSIM and FLIP of one view.
fn row((truth, delivered): (&Frame, &Frame)) -> anyhow::Result<[f64; 3]> {
    let (reference, test) = (Rgb8Image::of_view(&truth.view)?, Rgb8Image::of_view(&delivered.view)?);
    let psnr_db = psnr_db(&reference, &test, None)?.unwrap_or(f64::NAN).min(metrics::PSNR_CAP_DB);
    Ok([psnr_db, mean(&ssim_map(&reference, &test)?)?, mean(&flip_map(&reference, &test)?)?])
}

fn mean(map: &ScoreMap) -> anyhow::Result<f64> {
    Ok(map.mean(None)?.unwrap_or(f64::NAN))
}
