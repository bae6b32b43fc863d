//! The cluster as JSON: sample cameras, nodes, workloads and their plans.

use std::sync::Arc;

use axum::extract::{Query, State};
use axum::response::Response;
use cluster::{AchievedTime, ClusterStatus, NodeStatus, Policy, SessionPlan, WorkloadStatus};
use depth_image::SampleCamera;
use pictures::camera_frame;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::assets;
use crate::gateway::Gateway;
use crate::responses::{Refusal, as_json};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CamerasQuery {
    scene: Option<String>,
    #[serde(default)]
    moment: u32,
}

/// `cameras.json`: the sample cameras of views in a scene's plan, as a `transforms.json` has them, each with its view cell.
pub(crate) async fn cameras(
    State(gateway): State<Arc<Gateway>>,
    Query(query): Query<CamerasQuery>,
) -> Result<Response, Refusal> {
    let scene = gateway.scenes.visit(query.scene.as_deref()).await?;
    let shown = scene.session_of(query.moment);
    let _visit = shown.visits.begin();
    let workload = shown.opened().await?.plan().assignment.workload;
    let mut frames = Vec::new();
    for cell in 0..workload.view_cell_count() {
        let cameras = workload.cameras_of_cell(cell).map_or(&[][..], |cameras| &workload.sample_cameras[cameras]);
        for camera in SampleCamera::references(cameras) {
            let mut frame = camera_frame(&camera, scene.offer.source_space);
            frame.insert("cell".to_owned(), json!(cell));
            frames.push(Value::Object(frame));
        }
    }
    Ok(as_json(&json!({ "camera_model": "PINHOLE", "frames": frames })))
}

/// `status.json`.
pub(crate) async fn status(State(gateway): State<Arc<Gateway>>) -> Result<Response, Refusal> {
    let status = gateway.scenes.status().await.map_err(Refusal::unserved)?;
    let visitors = gateway.config.max_visitors - gateway.visitors.available_permits();
    Ok(as_json(&described(&status, visitors)))
}

fn described(status: &ClusterStatus, visitors: usize) -> Value {
    let nodes: Vec<Value> = status.nodes.iter().map(|node| described_node(status, node)).collect();
    let scenes: Vec<&str> = status.offers.iter().map(|offer| offer.name.as_str()).collect();
    let workloads: Vec<Value> = status.workloads.iter().map(described_workload).collect();
    json!({
        "version": assets::VERSION, "visitors": visitors, "plan_epoch": status.plan_epoch,
        "nodes": nodes, "scenes": scenes, "workloads": workloads,
    })
}

/// A node, with its roles in all plans and its busiest second.
fn described_node(status: &ClusterStatus, node: &NodeStatus) -> Value {
    let name = node.node_name.as_str();
    let plans: Vec<&SessionPlan> = status.workloads.iter().filter_map(|workload| workload.plan.as_ref()).collect();
    let samples = plans.iter().any(|plan| plan.assignment.samplers.iter().any(|share| share.node_name == name));
    let composites = plans.iter().any(|plan| plan.assignment.composites(name));
    let roles: Vec<&str> = [(samples, "sampler"), (composites, "compositor")]
        .into_iter()
        .filter_map(|(is, role)| is.then_some(role))
        .collect();
    let conditions = status.workloads.iter().flat_map(|workload| &workload.conditions);
    let busy = conditions.filter(|condition| condition.node_name == name).map(|condition| condition.busy_ratio);
    json!({ "name": name, "device": node.device_name, "roles": roles, "busy_ratio": busy.reduce(f64::max) })
}

fn described_workload(workload: &WorkloadStatus) -> Value {
    json!({
        "number": workload.number, "sessions": workload.session_count, "viewers": workload.viewer_count,
        "views_per_set": workload.views_per_set, "utilisation": workload.utilisation,
        "promise": workload.promise.as_ref().map(ToString::to_string),
        "shared_light": workload.shared_light.as_ref().map(|light| json!({
            "known_ratio": light.known_ratio, "surfaces_s": light.surfaces_s, "look_up_s": light.look_up_s,
            "unknown_points_s": light.unknown_s,
        })),
        "plan": workload.plan.as_ref().map(|plan| described_plan(plan, &workload.achieved)),
    })
}

fn described_plan(plan: &SessionPlan, achieved: &[AchievedTime]) -> Value {
    let assignment = &plan.assignment;
    let samplers: Vec<&str> = assignment.samplers.iter().map(|share| share.node_name.as_str()).collect();
    let compositors: Vec<&str> = assignment.compositors.iter().map(|share| share.node_name.as_str()).collect();
    let predicted = [
        (Policy::Pipeline, plan.predicted_pipeline_s),
        (Policy::Direct, plan.predicted_direct_s),
        (Policy::TimeShare, plan.predicted_time_share_s),
    ];
    let policies: Vec<Value> = predicted
        .into_iter()
        .map(|(policy, predicted_s)| {
            let achieved_s = achieved.iter().find(|time| time.policy == policy).map(|time| time.busy_s);
            json!({ "policy": policy.to_string(), "predicted_s": predicted_s, "achieved_s": achieved_s })
        })
        .collect();
    json!({
        "epoch": assignment.plan_epoch, "policy": assignment.policy.to_string(), "reason": plan.reason,
        "samplers": samplers, "compositors": compositors, "cells": assignment.workload.view_cell_count(),
        "common_cells": assignment.workload.common_cells.len(),
        "costs": {
            "sample_image_s": plan.costs.sample_image_s, "direct_view_s": plan.costs.direct_view_s,
            "reconstruct_view_s": plan.costs.reconstruct_view_s, "load_set_s": plan.costs.load_set_s,
            "encode_view_s": plan.costs.encode_view_s,
        },
        "policies": policies,
    })
}
