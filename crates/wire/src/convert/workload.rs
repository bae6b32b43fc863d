//! Workloads, timelines and costs.

use cluster::limits::MAX_CELLS;
use cluster::{Costs, TileCosts, Timeline, Workload, finite_seconds};

use super::geometry::{bounds_from, bounds_to, camera_to, sample_cameras_from, vec3_from, vec3_to};
use crate::error::{WireError, required};
use crate::proto;

impl From<proto::Timeline> for Timeline {
    fn from(t: proto::Timeline) -> Self {
        Self { start_s: t.start_s, step_s: t.step_s, set_count: t.set_count }
    }
}

impl From<Timeline> for proto::Timeline {
    fn from(t: Timeline) -> Self {
        Self { start_s: t.start_s, step_s: t.step_s, set_count: t.set_count }
    }
}

impl TryFrom<proto::Workload> for Workload {
    type Error = WireError;

    fn try_from(w: proto::Workload) -> Result<Self, WireError> {
        let workload = Self {
            scene: required(w.scene, "workload.scene")?.try_into()?,
            sample_cameras: sample_cameras_from(w.sample_cameras, w.cell_first_indices.len().clamp(1, MAX_CELLS))?,
            cell_first_indices: w.cell_first_indices,
            sampling: w.sampling_method,
            lighting: w.lighting,
            method: w.reconstruction_method,
            codec: w.frame_codec,
            volume: bounds_from(required(w.volume, "workload.volume")?)?,
            background_linear: vec3_from(w.background_linear_rgb, "background_linear_rgb")?,
            timeline: required(w.timeline, "workload.timeline")?.into(),
            illumination: required(w.illumination, "workload.illumination")?.try_into()?,
            refinement_steps: w.refinement_step_count,
        };
        workload.validate()?;
        Ok(workload)
    }
}

impl From<Workload> for proto::Workload {
    fn from(w: Workload) -> Self {
        Self {
            scene: Some(w.scene.into()),
            sample_cameras: w.sample_cameras.iter().map(camera_to).collect(),
            cell_first_indices: w.cell_first_indices,
            sampling_method: w.sampling,
            lighting: w.lighting,
            reconstruction_method: w.method,
            frame_codec: w.codec,
            volume: Some(bounds_to(&w.volume)),
            background_linear_rgb: vec3_to(w.background_linear),
            timeline: Some(w.timeline.into()),
            illumination: Some(w.illumination.into()),
            refinement_step_count: w.refinement_steps,
        }
    }
}

impl TryFrom<proto::Costs> for Costs {
    type Error = WireError;

    fn try_from(c: proto::Costs) -> Result<Self, WireError> {
        let shares = c.sample_row_shares.unwrap_or_default();
        let shares = [shares.first_ratio, shares.second_ratio, shares.third_ratio, shares.fourth_ratio];
        let row_shares = shares.iter().any(|&share| share != 0.0).then_some(shares);
        finite_seconds(c.sample_overhead_s, "sample_overhead_s")?;
        let costs = Self {
            sample_image_s: c.sample_image_s,
            direct_view_s: c.direct_view_s,
            reconstruct_view_s: c.reconstruct_view_s,
            load_set_s: c.load_set_s,
            encode_view_s: c.encode_view_s,
            in_order: c.is_sampled_in_order,
            tiles: TileCosts::of_image(c.sample_image_s, c.sample_overhead_s, row_shares),
        };
        costs.validate()?;
        Ok(costs)
    }
}

impl From<Costs> for proto::Costs {
    fn from(c: Costs) -> Self {
        let row_shares = c.tiles.and_then(|tiles| tiles.row_shares).unwrap_or_default();
        let [first_ratio, second_ratio, third_ratio, fourth_ratio] = row_shares;
        Self {
            sample_image_s: c.sample_image_s,
            direct_view_s: c.direct_view_s,
            reconstruct_view_s: c.reconstruct_view_s,
            load_set_s: c.load_set_s,
            encode_view_s: c.encode_view_s,
            is_sampled_in_order: c.in_order,
            sample_overhead_s: c.tile_overhead_s(),
            sample_row_shares: Some(proto::RowShares { first_ratio, second_ratio, third_ratio, fourth_ratio }),
        }
    }
}
