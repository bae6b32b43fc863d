//! A plan for tests.

use cluster::{Assignment, Policy, SamplePlanes, SceneHash, SceneRef, Timeline, Workload};
use depth_image::{Aabb, Environment, Illumination};
use glam::Vec3;

/// A still scene without cameras.
pub(crate) fn workload() -> Workload {
    Workload {
        scene: SceneRef { hash: SceneHash::of(b""), package_bytes: 0 },
        sample_cameras: Vec::new(),
        cell_first_indices: Vec::new(),
        common_cells: Vec::new(),
        sampling: "conventional".to_owned(),
        lighting: "unlit".to_owned(),
        planes: SamplePlanes::default(),
        volume: Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE },
        background: Environment::default(),
        timeline: Timeline::still(0.0),
        illumination: Illumination::default(),
        refinement_steps: 1,
        traced_pixel_count: None,
    }
}

/// Plan 1, without nodes.
pub(crate) fn assignment() -> Assignment {
    Assignment {
        plan_epoch: 1,
        workload_number: 1,
        policy: Policy::Pipeline,
        workload: workload(),
        samplers: Vec::new(),
        compositors: Vec::new(),
        tile_count: 1,
        relay_fanout: None,
        method: None,
        audit: None,
    }
}
