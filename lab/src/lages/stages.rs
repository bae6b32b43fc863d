//! Figure 6 of the paper: the time of each stage at the headline's V.

use report::{Cell, Table};

use super::timing::{Run, Times};

/// A table of the stages. Sampling, decoding with the upload, compositing and encoding are costs measured alone, times their
/// number. Transfer is the rest of the wait for the set, and delivery the rest of the total. Stages overlap: where the parts
/// exceed the total, the rest is 0.
///
/// # Errors
/// A row does not fit the table.
pub fn stages(times: &Times) -> anyhow::Result<Table> {
    let stages = ["sampling", "transfer", "decode and upload", "compositing", "encode", "delivery", "total"];
    let columns: Vec<(&str, &str)> = [("method", "")].into_iter().chain(stages.map(|stage| (stage, "s"))).collect();
    let mut table = Table::new(format!("Time per stage, {} views", times.headline_views), &columns);
    let mut rows: Vec<(String, [f64; 6])> = Vec::new();
    for (name, runs) in &times.pipelines {
        let headline = runs.iter().find(|run| run.views == times.headline_views);
        rows.extend(headline.map(|run| (name.clone(), pipeline_stages(run, times.images))));
    }
    let direct = times.direct.last();
    rows.extend(direct.map(|run| (format!("direct, extended from {} views", run.views), direct_stages(run, times))));
    for (name, parts) in rows {
        let total: f64 = parts.iter().sum();
        table.push([Cell::from(name)].into_iter().chain(parts.map(Cell::from)).chain([Cell::from(total)]))?;
    }
    Ok(table)
}

fn pipeline_stages(run: &Run, images: usize) -> [f64; 6] {
    let costs = run.plan.costs;
    let views = run.views as f64;
    let sampling = images as f64 * costs.sample_image_s;
    let loading = run.plan.assignment.compositors.len() as f64 * costs.load_set_s;
    let transfer = (run.set_wait_s - sampling - loading).max(0.0);
    let compositing = views * costs.reconstruct_view_s;
    let encode = views * costs.encode_view_s;
    let delivery = (run.seconds - sampling - transfer - loading - compositing - encode).max(0.0);
    [sampling, transfer, loading, compositing, encode, delivery]
}

fn direct_stages(run: &Run, times: &Times) -> [f64; 6] {
    let costs = run.plan.costs;
    let views = times.headline_views as f64;
    let drawing = views * costs.direct_view_s;
    let encode = views * costs.encode_view_s;
    let delivery = (times.direct_view_s() * views - drawing - encode).max(0.0);
    [0.0, 0.0, 0.0, drawing, encode, delivery]
}
