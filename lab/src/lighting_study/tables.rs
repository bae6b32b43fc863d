//! Tables of lightings.

use cluster::Costs;
use coordinator::schedule::k_fd;
use report::Table;

use super::measure::Row;

pub(super) fn parts(rows: &[Row]) -> anyhow::Result<Table> {
    let columns = [
        ("lighting", ""),
        ("g_s a sample", "ms"),
        ("g_v a view", "ms"),
        ("d a set", "ms"),
        ("c a view", "ms"),
        ("e a view", "ms"),
        ("c / g_v", ""),
        ("c over unlit", "×"),
        ("K of the formula", ""),
    ];
    let mut table = Table::new("What light costs", &columns);
    let unlit_c = rows.first().map_or(f64::NAN, |row| row.costs.reconstruct_view_s);
    for row in rows {
        let c: Costs = row.costs;
        let ms = [c.sample_image_s, c.direct_view_s, c.load_set_s, c.reconstruct_view_s, c.encode_view_s];
        let ratios = [c.reconstruct_view_s / c.direct_view_s, c.reconstruct_view_s / unlit_c];
        let views = row.pipelines.first().map_or(0, |(views, _)| *views);
        let k = k_fd(row.images, c.sample_image_s, views, c.reconstruct_view_s + c.encode_view_s, row.nodes);
        let numbers = ms.map(|s| (s * 1e3).into()).into_iter().chain(ratios.map(Into::into));
        table.push([row.lighting.to_string().into()].into_iter().chain(numbers).chain([k.into()]))?;
    }
    Ok(table)
}

pub(super) fn gains(rows: &[Row]) -> anyhow::Result<Table> {
    let columns = [
        ("lighting", ""),
        ("views V", ""),
        ("pipeline", "s"),
        ("direct, extended", "s"),
        ("timed on views", ""),
        ("gain", "×"),
        ("its parts allow", "×"),
        ("share of it", "%"),
    ];
    let mut table = Table::new("What sharing gains", &columns);
    for row in rows {
        for &(views, seconds) in &row.pipelines {
            let (gain, allowed) = (row.gain((views, seconds)), row.allowed(views));
            table.push([
                row.lighting.to_string().into(),
                views.into(),
                seconds.into(),
                (row.direct_view_s * views as f64).into(),
                row.direct_views.into(),
                gain.into(),
                allowed.into(),
                (gain / allowed * 100.0).into(),
            ])?;
        }
    }
    Ok(table)
}
