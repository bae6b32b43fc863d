//! A workload and a plan for tests.

use depth_image::{Aabb, Environment, Illumination, Light, PinholeCamera};
use glam::{UVec2, Vec3};

use crate::{Assignment, CompositorShare, Policy, SamplePlanes, SamplerShare, SceneHash, SceneRef, Timeline, Workload};

pub(crate) fn camera() -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, Vec3::Y, 0.8, UVec2::new(40, 30))
}

fn illumination() -> Illumination {
    let position_in_world = Vec3::new(0.0, 4.0, 1.0);
    let intensity_linear = Vec3::new(3.0, 2.0, 1.0);
    let lights = vec![Light::Point { position_in_world, intensity_linear, radius_m: 0.0 }; 4];
    Illumination { lights, environment: Environment::gradient(Vec3::ONE, Vec3::splat(0.1)) }
}

pub(crate) fn workload() -> Workload {
    Workload {
        scene: SceneRef { hash: SceneHash::of(b"scene"), package_bytes: 5 },
        sample_cameras: vec![camera().into(); 2],
        cell_first_indices: Vec::new(),
        common_cells: Vec::new(),
        sampling: "conventional".to_owned(),
        lighting: "phong".to_owned(),
        planes: SamplePlanes::default(),
        volume: Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE },
        background: Environment::uniform(Vec3::splat(0.2)),
        timeline: Timeline { start_s: 1.0, step_s: 0.5, set_count: 3 },
        illumination: illumination(),
        refinement_steps: 1,
        traced_pixel_count: None,
    }
}

pub(crate) fn assignment() -> Assignment {
    Assignment {
        plan_epoch: 4,
        workload_number: 3,
        policy: Policy::Pipeline,
        workload: workload(),
        samplers: vec![SamplerShare {
            node_name: "a".to_owned(),
            address: "http://127.0.0.1:1".to_owned(),
            image_indices: vec![0, 1],
        }],
        compositors: vec![CompositorShare {
            node_name: "b".to_owned(),
            address: "http://127.0.0.1:2".to_owned(),
            view_weight: 7,
        }],
        tile_count: 1,
        relay_fanout: None,
        method: None,
        audit: None,
    }
}
