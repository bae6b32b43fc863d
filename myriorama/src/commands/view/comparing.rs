//! The comparison of written views with the same views drawn directly.

use std::path::Path;

use anyhow::Context as _;
use app_core::delivery::{open, receive_requests, requests};
use app_core::print_line;
use client::Frame;
use cluster::{BudgetRequest, DIRECT, PolicyChoice, SessionRequest};
use depth_image::{View, ViewPlanes};
use metrics::PictureErrors;
use report::{Cell, Table};

use super::args::ViewArgs;
use super::file_names::FileNames;
use super::job::Job;

/// Errors over the foreground, then over the whole picture.
type Row = [f64; 6];

const COLUMNS: [(&str, &str); 7] = [
    ("view", ""),
    ("foreground PSNR", "dB"),
    ("foreground SSIM", ""),
    ("foreground FLIP", ""),
    ("PSNR", "dB"),
    ("SSIM", ""),
    ("FLIP", ""),
];

/// Asks for the same views drawn directly, and writes how far the written ones are from them. One frame at a time is compared;
/// others wait at the client. A view takes 32 bytes, and its row of the table.
pub(super) async fn compare(args: &ViewArgs, job: &Job, views: u64) -> anyhow::Result<()> {
    // Depth tells where a surface is.
    let planes = ViewPlanes { inverse_depth: true, ..job.request.planes };
    let budget = BudgetRequest::default();
    let lighting = args.compare_lighting.map_or_else(|| job.request.lighting.clone(), |lighting| lighting.to_string());
    let direct = SessionRequest {
        method: DIRECT.to_owned(),
        policy: PolicyChoice::Auto,
        lighting,
        planes,
        budget,
        ..job.request.clone()
    };
    let session = open(&job.client, direct).await?;
    let mut rows = Vec::with_capacity(views as usize);
    let received = async |frame: Frame| {
        let number = frame.request.frame;
        let written = args.out.join(FileNames::of(number, ViewPlanes::default()).color);
        let row = tokio::task::spawn_blocking(move || row(&frame.view, &written)).await??;
        rows.push((number as usize, row));
        Ok(())
    };
    receive_requests(&session, requests(args.frames, job.cameras.clone()), received).await?;
    let table = table(rows)?;
    print_line!("\n{}", table.to_text());
    let path = args.out.join("comparison.csv");
    std::fs::write(&path, table.to_csv()?).with_context(|| format!("cannot write {}", path.display()))
}

/// A table with a row for each view, by number, then the mean and the worst of each column.
fn table(mut rows: Vec<(usize, Row)>) -> anyhow::Result<Table> {
    let mut table = Table::new("Against views drawn directly", &COLUMNS);
    rows.sort_by_key(|(number, _)| *number);
    let means = std::array::from_fn(|column| rows.iter().map(|(_, row)| row[column]).sum::<f64>() / rows.len() as f64);
    let worst = std::array::from_fn(|column| {
        let numbers = rows.iter().map(|(_, row)| row[column]);
        // FLIP is an error, and PSNR and SSIM are likenesses.
        if column % 3 == 2 { numbers.fold(f64::NEG_INFINITY, f64::max) } else { numbers.fold(f64::INFINITY, f64::min) }
    });
    let views = rows.iter().map(|(number, row)| (Cell::from(*number), *row));
    for (name, numbers) in views.chain([("mean".into(), means), ("worst".into(), worst)]) {
        table.push([name].into_iter().chain(numbers.map(Cell::from)))?;
    }
    Ok(table)
}

/// PSNR, SSIM and FLIP of a written picture, against a view with depth.
fn row(truth: &View, written: &Path) -> anyhow::Result<Row> {
    let picture = image::open(written).with_context(|| format!("cannot read {}", written.display()))?.into_rgb8();
    let test = View::from_srgb8(picture.dimensions().into(), picture.into_raw());
    let [foreground, whole] = PictureErrors::of(truth, &test)?;
    Ok([foreground.psnr_db, foreground.ssim, foreground.flip, whole.psnr_db, whole.ssim, whole.flip])
}
