//! Delivered views beside the same views drawn directly.

use client::Frame;
use metrics::{Rgb8Image, ScoreMap, flip_map, psnr_db, ssim_map};
use table::Table;

/// Errors of one view.
struct Errors {
    psnr_db: f64,
    ssim: f64,
    flip: f64,
}

/// A table with a row a view, the mean and the worst of each column; and the worst PSNR.
///
/// # Errors
/// Views differ in size.
pub fn table(truth: &[Frame], delivered: &[Frame]) -> anyhow::Result<(Table, f64)> {
    let columns = [("view", ""), ("PSNR", "dB"), ("SSIM", ""), ("FLIP", "")];
    let mut table = Table::new("Against views drawn directly", &columns);
    let errors = truth.iter().zip(delivered).map(errors).collect::<anyhow::Result<Vec<_>>>()?;
    for (number, Errors { psnr_db, ssim, flip }) in errors.iter().enumerate() {
        table.push([number.into(), (*psnr_db).into(), (*ssim).into(), (*flip).into()])?;
    }
    let mean = |value: fn(&Errors) -> f64| errors.iter().map(value).sum::<f64>() / errors.len() as f64;
    let least = |value: fn(&Errors) -> f64| errors.iter().map(value).fold(f64::INFINITY, f64::min);
    let means = [mean(|e| e.psnr_db), mean(|e| e.ssim), mean(|e| e.flip)];
    let worst = [least(|e| e.psnr_db), least(|e| e.ssim), -least(|e| -e.flip)];
    for (name, numbers) in [("mean", means), ("worst", worst)] {
        table.push([name.into()].into_iter().chain(numbers.map(Into::into)))?;
    }
    Ok((table, worst[0]))
}

fn errors((truth, delivered): (&Frame, &Frame)) -> anyhow::Result<Errors> {
    let (reference, test) = (Rgb8Image::of_view(&truth.view)?, Rgb8Image::of_view(&delivered.view)?);
    Ok(Errors {
        psnr_db: psnr_db(&reference, &test, None)?.unwrap_or(f64::NAN).min(metrics::PSNR_CAP_DB),
        ssim: mean(&ssim_map(&reference, &test)?)?,
        flip: mean(&flip_map(&reference, &test)?)?,
    })
}

fn mean(map: &ScoreMap) -> anyhow::Result<f64> {
    Ok(map.mean(None)?.unwrap_or(f64::NAN))
}
