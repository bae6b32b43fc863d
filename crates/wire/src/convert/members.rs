//! Members: joining, being measured and being ready; their reports, and the cluster's status.

use cluster::limits::{MAX_BATCH, MAX_PROBE_VIEWS, MAX_SCENES, MAX_VIEWPOINTS, MAX_WORKLOADS};
use cluster::{
    AchievedTime, AuditReport, AuditedView, BudgetMeasurement, ClusterStatus, JoinCluster, MeasureCosts, Measured,
    NodeCondition, NodeStatus, Ready, SamplerReport, SharedLightCosts, ViewErrors, Welcome, WorkReport, WorkloadStatus,
    at_most, finite_seconds,
};

use crate::error::{PROTOCOL_VERSION, check_version};

messages! {
    JoinClusterRequest = JoinCluster {
        plan_epoch; node: node_name | node_address | device_name | is_software_device
    }, with protocol_version = PROTOCOL_VERSION,
        first |r| check_version(r.protocol_version), then JoinCluster::validate;
    JoinClusterResponse = Welcome { scenes }, first |w| at_most(w.scenes.len(), MAX_SCENES, "scenes");
    NodeStatus = NodeStatus { node_name, device_name; address: node_address, is_software: is_software_device };
    MeasureCostsRequest = MeasureCosts {
        workload, typical_views, batch_count, budget; method: reconstruction_method, codec: frame_codec, in_background: is_background,
        planes: antialias_sample_count | exposure_ev | tone_curve | with_inverse_depth | with_provenance
    }, first |r| at_most(r.typical_views.len(), MAX_BATCH as usize, "typical_views"), then MeasureCosts::validate;
    BudgetMeasurement = BudgetMeasurement { truth_lighting };
    MeasureCostsResponse = Measured {
        costs, traced_pixel_count, shared_light, views, busy_s;
        planes: with_normals | with_corner_inverse_depths | with_light, auto_exposure: auto_exposure_ev
    }, first |r| at_most(r.views.len(), MAX_BATCH as usize, "views"), then Measured::validate;
    SharedLightCosts = SharedLightCosts { known_ratio, surfaces_s, look_up_s, unknown_s },
        then SharedLightCosts::validate;
    ProbedView = ViewErrors {
        foreground_ratio; flip: flip_ratio, mean_square: mean_square_ratio
    };
    ApplyAssignmentResponse = Ready { plan_epoch, scene_load_s }, then |r| finite_seconds(r.scene_load_s, "scene_load_s");
    ReportWorkRequest = WorkReport {
        node_name, plan_epoch, workload_number, busy_s, viewpoints, audit;
        costs: sample_image_s | direct_view_s | reconstruct_view_s | load_set_s | encode_view_s | transfer_bytes_per_s
            | image_bytes,
        views: view_count, dropped_views: dropped_view_count
    }, first |r| at_most(r.viewpoints.len(), MAX_VIEWPOINTS, "viewpoints"), then WorkReport::validate;
    AuditReport = AuditReport {
        views; covered_views: covered_view_count, uncovered_views: uncovered_view_count
    }, first |r| at_most(r.views.len(), MAX_PROBE_VIEWS, "audit.views");
    AuditedView = AuditedView { plan_epoch, errors, is_part };
    ReportSamplerRequest = SamplerReport { plan_epoch, reason; compositor: compositor_name, sampler: sampler_name },
        then SamplerReport::validate;
    AchievedTime = AchievedTime { policy, busy_s };
    NodeCondition = NodeCondition {
        node_name, is_ready, costs, busy_ratio; views: view_count, dropped_views: dropped_view_count
    };
    GetStatusResponse = ClusterStatus {
        plan_epoch, nodes, offers, workloads
    }, first |s| {
        at_most(s.offers.len(), MAX_SCENES, "offers")?;
        at_most(s.workloads.len(), MAX_WORKLOADS, "workloads")
    }, then ClusterStatus::validate;
    WorkloadStatus = WorkloadStatus {
        plan, session_count, viewer_count, conditions, promise, shared_light;
        number: workload_number, views_per_set: views_per_set_count, achieved: achieved_times,
        utilisation: utilisation_ratio, one_more_viewer: one_more_viewer_ratio
    };
}
