//! Figure 6 of the paper: the time of each stage at the headline's V.

use report::{Cell, Table};

use super::read_back::ReadBack;
use super::timing::{Run, Times};

/// A table of the stages. Sampling, the copies of images and views from the device to the host, decoding with the upload,
/// compositing and encoding are costs measured alone, times their number. Transfer is the rest of the wait for the set, and
/// delivery the rest of the total. Stages overlap: where the parts exceed the total, the rest is 0.
///
/// # Errors
/// A row does not fit the table.
pub fn stages(times: &Times, read_back: ReadBack) -> anyhow::Result<Table> {
    let stages =
        ["sampling", "read-back", "transfer", "decode and upload", "compositing", "encode", "delivery", "total"];
    let columns: Vec<(&str, &str)> = [("method", "")].into_iter().chain(stages.map(|stage| (stage, "s"))).collect();
    let mut table = Table::new(format!("Time per stage, {} views", times.headline_views), &columns);
    let mut rows: Vec<(String, [f64; 7])> = Vec::new();
    for (name, runs) in &times.pipelines {
        let headline = runs.iter().find(|run| run.views == times.headline_views);
        rows.extend(headline.map(|run| (name.clone(), pipeline_stages(run, times.images, read_back))));
    }
    let direct = times.direct.last();
    rows.extend(
        direct.map(|run| (format!("direct, extended from {} views", run.views), direct_stages(run, times, read_back))),
    );
    for (name, parts) in rows {
        let total: f64 = parts.iter().sum();
        table.push([Cell::from(name)].into_iter().chain(parts.map(Cell::from)).chain([Cell::from(total)]))?;
    }
    Ok(table)
}

fn pipeline_stages(run: &Run, images: usize, read_back: ReadBack) -> [f64; 7] {
    let costs = run.plan.costs;
    let views = run.views as f64;
    let images_s = images as f64 * read_back.image_s;
    let views_s = views * read_back.view_s;
    // The costs of images and views include their read-back.
    let sampling = images as f64 * costs.sample_image_s - images_s;
    let loading = run.plan.assignment.compositors.len() as f64 * costs.load_set_s;
    let transfer = (run.set_wait_s - sampling - images_s - loading).max(0.0);
    let compositing = views * costs.reconstruct_view_s - views_s;
    let encode = views * costs.encode_view_s;
    let copies = images_s + views_s;
    let delivery = (run.seconds - sampling - copies - transfer - loading - compositing - encode).max(0.0);
    [sampling, copies, transfer, loading, compositing, encode, delivery]
}

fn direct_stages(run: &Run, times: &Times, read_back: ReadBack) -> [f64; 7] {
    let costs = run.plan.costs;
    let views = times.headline_views as f64;
    let copies = views * read_back.view_s;
    let drawing = views * costs.direct_view_s - copies;
    let encode = views * costs.encode_view_s;
    let delivery = (times.direct_view_s() * views - copies - drawing - encode).max(0.0);
    [0.0, copies, 0.0, 0.0, drawing, encode, delivery]
}
