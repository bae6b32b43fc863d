//! A skinned model: a snake that slithers, or rears its head.

use std::f32::consts::{PI, TAU};

use depth_image::Environment;
use glam::{Affine3A, DAffine3, Quat, Vec3};

use super::parts::{MeshBuilder, matt, vertex};
use crate::{
    Animation, Channel, Clip, Influence, Instance, Interpolation, Joint, Mesh, MovingInstance, Node, NodeTransform,
    Property, Scene, TransformParts,
};

const LENGTH_M: f32 = 4.0;
const RINGS: u32 = 501;
const SIDES: u32 = 50;
const JOINTS: u32 = 24;
/// A joint's distance from the one before.
const BONE_M: f32 = LENGTH_M / JOINTS as f32;

/// Time between keys.
const KEY_S: f32 = 0.125;
const SLITHER_S: f32 = 2.0;
/// Largest turn of a joint while the snake slithers, radians.
const BEND_RAD: f32 = 0.28;
/// Waves along the body.
const WAVES: f32 = 1.25;
const REAR_S: f32 = 4.0;
/// The joints of the neck, and the turn of each while the head is up, radians.
const NECK_JOINTS: u32 = 8;
const REAR_RAD: f32 = 0.2;

/// A snake along the x axis, 4 m long and of 50,000 triangles, on a ground of 2. Its 24 joints have two clips: `slither`
/// (2 s, straight between keys) and `rear` (4 s, splines).
#[must_use]
pub fn snake() -> Scene {
    let (body, influences) = body();
    let joints = (0..JOINTS).map(|node| {
        let bind = Vec3::X * joint_x_m(node);
        Joint { node, joint_from_mesh: DAffine3::from_translation(-bind.as_dvec3()) }
    });
    let moving = MovingInstance { instance: 0, joints: joints.collect(), influences };
    let animation = Animation {
        nodes: (0..JOINTS).map(bone).collect(),
        clips: vec![slither(), rear()],
        playing: Some(0),
        moving: vec![moving],
        ..Animation::default()
    };
    let instances = (0..2).map(|mesh| Instance { mesh, world_from_mesh: Affine3A::IDENTITY });
    Scene {
        name: "snake".into(),
        meshes: vec![body, ground()],
        instances: instances.collect(),
        materials: vec![matt("skin"), matt("sand")],
        background: Environment::uniform(Vec3::new(0.46, 0.60, 0.80)),
        animation: Some(animation),
        ..Scene::default()
    }
    .with_default_lights()
}

/// The tail is at the first joint, and the head is half a bone beyond the last one.
fn joint_x_m(joint: u32) -> f32 {
    (joint as f32 + 0.5) * BONE_M - LENGTH_M * 0.5
}

fn bone(number: u32) -> Node {
    let along_m = if number == 0 { joint_x_m(0) } else { BONE_M };
    let rest = TransformParts { translation: Vec3::X * along_m, rotation: Quat::IDENTITY, scale: Vec3::ONE };
    Node { parent: number.checked_sub(1), rest: NodeTransform::Parts(rest) }
}

fn radius_m(share: f32) -> f32 {
    // A tail that thins out, a neck, and a head.
    let body = 0.16 * (1.0 - (1.0 - share).powi(3)).max(0.0).sqrt();
    let head = 0.05 * (-((share - 0.94) / 0.035).powi(2)).exp();
    let snout = (1.0 - ((share - 0.93) / 0.07).clamp(0.0, 1.0).powi(2)).sqrt();
    (body * (1.0 - 0.35 * ((share - 0.6) / 0.3).clamp(0.0, 1.0)) + head) * snout
}

fn body() -> (Mesh, Vec<Influence>) {
    let mut builder = MeshBuilder::default();
    let mut influences = Vec::new();
    for ring in 0..RINGS {
        let share = ring as f32 / (RINGS - 1) as f32;
        let x_m = (share - 0.5) * LENGTH_M;
        let step = 0.5 / RINGS as f32;
        let slope = (radius_m((share + step).min(1.0)) - radius_m((share - step).max(0.0))) / (2.0 * step * LENGTH_M);
        for side in 0..SIDES {
            let (sin, cos) = f32::sin_cos(TAU * side as f32 / SIDES as f32);
            let out = Vec3::new(0.0, cos, sin);
            let normal = (out - Vec3::X * slope).normalize_or(out);
            builder.push(vertex(Vec3::X * x_m + out * radius_m(share), normal, color(share, cos)));
            influences.push(influence(x_m));
        }
    }
    builder.join_rings(0, RINGS, SIDES, false);
    builder.finish_part(0);
    (builder.into_mesh(), influences)
}

/// Dark bands on the back and a pale belly.
fn color(share: f32, up: f32) -> Vec3 {
    let band = (share * 22.0 * PI).sin() + 0.4 * up;
    let back = if band > 0.55 { Vec3::new(58.0, 44.0, 30.0) } else { Vec3::new(150.0, 130.0, 62.0) };
    if up < -0.35 { Vec3::new(216.0, 204.0, 160.0) } else { back }
}

/// Between two joints, both count by their distance.
fn influence(x_m: f32) -> Influence {
    let place = ((x_m - joint_x_m(0)) / BONE_M).clamp(0.0, (JOINTS - 1) as f32);
    let before = place.floor();
    let share = place.fract();
    let after = (before as u16 + 1).min(JOINTS as u16 - 1);
    Influence { joints: [before as u16, after, 0, 0], weights: [1.0 - share, share, 0.0, 0.0] }
}

fn bend_rad(joint: u32, time_s: f32) -> f32 {
    BEND_RAD * (TAU * (time_s / SLITHER_S - WAVES * joint as f32 / JOINTS as f32)).sin()
}

/// The mean direction of all bones, against which the tail turns, so that the snake stays on its ground.
fn mean_rad(time_s: f32) -> f32 {
    (1..JOINTS).map(|joint| bend_rad(joint, time_s) * ((JOINTS - joint) as f32 / JOINTS as f32)).sum()
}

fn slither() -> Clip {
    let keys = (SLITHER_S / KEY_S) as u32;
    let times_s: Vec<f32> = (0..=keys).map(|key| key as f32 * KEY_S).collect();
    let channels = (0..JOINTS).map(|node| {
        let turns_rad =
            times_s.iter().map(|&time_s| if node == 0 { -mean_rad(time_s) } else { bend_rad(node, time_s) });
        Channel {
            node,
            property: Property::Rotation,
            interpolation: Interpolation::Linear,
            values: turns_rad.map(|turn_rad| Quat::from_rotation_y(turn_rad).into()).collect(),
            times_s: times_s.clone(),
        }
    });
    Clip { name: "slither".into(), channels: channels.collect() }
}

fn rear() -> Clip {
    let at_rest = Quat::IDENTITY.into();
    let level = glam::Vec4::ZERO;
    let foot = JOINTS - NECK_JOINTS;
    let channels = (foot..JOINTS).map(|joint| {
        // The neck rises at its foot, and levels out again towards the head.
        let turn_rad = if joint < foot + NECK_JOINTS / 2 { REAR_RAD } else { -REAR_RAD };
        let up = Quat::from_rotation_z(turn_rad).into();
        Channel {
            node: joint,
            property: Property::Rotation,
            interpolation: Interpolation::CubicSpline,
            times_s: vec![0.0, REAR_S * 0.4, REAR_S * 0.6, REAR_S],
            values: [at_rest, up, up, at_rest].into_iter().flat_map(|value| [level, value, level]).collect(),
        }
    });
    Clip { name: "rear".into(), channels: channels.collect() }
}

fn ground() -> Mesh {
    let mut builder = MeshBuilder::default();
    let sand = Vec3::new(206.0, 186.0, 146.0);
    builder.rectangle(Vec3::Y * -0.16, Vec3::Z * 1.6, Vec3::X * 2.8, sand);
    builder.finish_part(1);
    builder.into_mesh()
}
