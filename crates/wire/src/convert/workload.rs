//! Scenes, workloads, costs and plans.

use cluster::limits::{MAX_CELLS, MAX_COMMON_CELLS, MAX_NODES, MAX_SAMPLE_CAMERAS, MAX_TILES, MAX_WORKLOADS};
use cluster::{
    ApplyPlan, Assignment, AuditOrder, CommonCell, CommonKind, CompositorShare, Costs, FetchScene, InvalidField,
    Policy, SamplerShare, ScenePart, SceneRef, TileCosts, Timeline, Workload, at_most, finite_seconds, nonempty,
};

use super::Convert;
use crate::error::WireError;
use crate::proto;

enums! { Policy { Pipeline, Direct, TimeShare } CommonKind { Mirrors, Base, Block } }

messages! {
    SceneRef = SceneRef { package_bytes; hash: scene_hash }, then SceneRef::validate;
    FetchSceneRequest = FetchScene { offset_bytes; hash: scene_hash };
    FetchSceneResponse = ScenePart { offset_bytes, data };
    Timeline = Timeline { start_s, step_s, set_count };
    Workload = Workload {
        scene as "workload.scene", sample_cameras, cell_first_indices, common_cells, lighting, volume as "workload.volume",
        timeline as "workload.timeline", illumination as "workload.illumination", background as "workload.background", traced_pixel_count;
        sampling: sampling_method, planes: with_normals | with_corner_inverse_depths | with_light,
        refinement_steps: refinement_step_count
    }, first |w| {
        at_most(w.common_cells.len(), MAX_COMMON_CELLS, "common_cells")?;
        let cells = w.cell_first_indices.len().clamp(1, MAX_CELLS + MAX_COMMON_CELLS);
        at_most(w.sample_cameras.len(), MAX_SAMPLE_CAMERAS * cells, "sample_cameras")
    }, then Workload::validate;
    CommonCell = CommonCell { kind as "common_cells.kind", bounds as "common_cells.bounds"; sampling: sampling_method };
    Assignment = Assignment {
        plan_epoch, workload_number, policy, workload as "assignment.workload", samplers, compositors, tile_count, audit;
        relay_fanout: relay_fanout_count, method: reconstruction_method
    }, first |a| {
        a.tile_count = a.tile_count.max(1);
        at_most(a.samplers.len(), MAX_NODES, "samplers")?;
        at_most(a.compositors.len(), MAX_NODES, "compositors")
    }, then Assignment::validate;
    AuditOrder = AuditOrder {
        time_ratio, planned_pixel_count, truth_lighting; antialias: antialias_sample_count
    }, then AuditOrder::validate;
    ApplyAssignmentRequest = ApplyPlan { assignment; open_workloads: open_workload_numbers },
        first |r| at_most(r.open_workload_numbers.len(), MAX_WORKLOADS, "open_workload_numbers");
    SamplerShare = SamplerShare { node_name, image_indices; address: node_address },
        first |s| {
            let most = (MAX_CELLS + MAX_COMMON_CELLS) * MAX_SAMPLE_CAMERAS * MAX_TILES as usize;
            at_most(s.image_indices.len(), most, "image_indices")?;
            check_node(&s.node_name, &s.node_address)
        };
    CompositorShare = CompositorShare { node_name; address: node_address, view_weight: dealt_view_count },
        first |s| check_node(&s.node_name, &s.node_address);
}

fn check_node(name: &str, address: &str) -> Result<(), InvalidField> {
    nonempty(name, "node_name")?;
    nonempty(address, "node_address")
}

nested!(Costs = Costs);

impl Convert<proto::Costs> for Costs {
    fn read(c: proto::Costs, _: &'static str) -> Result<Self, WireError> {
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

    fn write(self) -> proto::Costs {
        let row_shares = self.tiles.and_then(|tiles| tiles.row_shares).unwrap_or_default();
        let [first_ratio, second_ratio, third_ratio, fourth_ratio] = row_shares;
        proto::Costs {
            sample_image_s: self.sample_image_s,
            direct_view_s: self.direct_view_s,
            reconstruct_view_s: self.reconstruct_view_s,
            load_set_s: self.load_set_s,
            encode_view_s: self.encode_view_s,
            is_sampled_in_order: self.in_order,
            sample_overhead_s: self.tile_overhead_s(),
            sample_row_shares: Some(proto::RowShares { first_ratio, second_ratio, third_ratio, fourth_ratio }),
        }
    }
}
