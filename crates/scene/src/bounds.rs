//! Boxes around what moves, over all moments.

use depth_image::Aabb;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::{Animation, Instance, Mesh, MovingInstance, Scene};

/// Most moments at which a clip is sampled.
const MOST_MOMENTS: usize = 2048;
/// Fewest moments between two neighbouring keys.
const MOMENTS_BETWEEN_KEYS: usize = 4;
/// Moments of a clip with few keys: the more there are, the closer are the bounds.
const FEW_KEYS_MOMENTS: usize = 256;
/// Most steps of sampling, over nodes, channels and corners of boxes: large skeletons have fewer moments.
const MOST_STEPS: usize = 8_000_000;
/// Most corners of boxes at once, unless one moment has more.
const MOST_CORNERS: usize = 1 << 20;
/// The fewest moments of any clip.
const FEWEST_MOMENTS: usize = 16;

impl Scene {
    /// The box around all surfaces at every scene time; see [`Scene::bounds_of_instances`]. Empty for a scene without
    /// vertices.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        Aabb::of_boxes(&self.bounds_of_instances())
    }

    /// The box around each instance at every scene time, including the wind's sway.
    ///
    /// An instance that moves is sampled at all keys of the clip that plays and at moments between. At a moment, its
    /// vertices lie between boxes that its joints carry. Each corner of these boxes may leave the straight way between
    /// two moments by half of that way: as far as an arc of 180°.
    #[must_use]
    pub fn bounds_of_instances(&self) -> Vec<Aabb> {
        let mut boxes: Vec<Aabb> = self.instances.iter().map(|instance| self.at_rest(instance)).collect();
        let Some(animation) = &self.animation else { return boxes };
        for (moving, swept) in animation.moving.iter().zip(self.swept(animation)) {
            let place = boxes.get_mut(moving.instance as usize);
            if let (Some(place), Some(mesh)) = (place, self.mesh_of(moving)) {
                *place = self.swayed(swept, mesh);
            }
        }
        boxes
    }

    fn at_rest(&self, instance: &Instance) -> Aabb {
        let Some(mesh) = self.meshes.get(instance.mesh as usize) else { return Aabb::EMPTY };
        let points = mesh.vertices.iter().map(|v| instance.world_from_mesh.transform_point3(Vec3::from(v.position)));
        self.swayed(Aabb::around(points), mesh)
    }

    fn swayed(&self, still: Aabb, mesh: &Mesh) -> Aabb {
        let sway = mesh.vertices.iter().fold(0.0f32, |most, v| most.max(v.sway));
        let reach = self.wind.map_or(Vec3::ZERO, |w| (w.direction_in_world * w.amplitude_m * sway).abs());
        Aabb { min: still.min - reach, max: still.max + reach }
    }

    /// The box of each moving instance over all moments, without wind; infinite where numbers overflow.
    pub(crate) fn swept(&self, animation: &Animation) -> Vec<Aabb> {
        let carried: Vec<Vec<Carried>> = animation.moving.iter().map(|moving| self.carried_by(moving)).collect();
        let corners: usize = carried.iter().map(|boxes| boxes.len() * 8).sum();
        let channels = animation.clip().map_or(0, |clip| clip.channels.len());
        let most = MOST_STEPS / (animation.nodes.len() + channels + corners).max(1);
        let moments = moments(animation, most);
        // Corners of all moments at once would fill memory.
        let mut boxes = vec![Aabb::EMPTY; carried.len()];
        let mut before: Option<(f32, Vec<Vec<DVec3>>)> = None;
        for some in moments.chunks((MOST_CORNERS / corners.max(1)).clamp(1, 32)) {
            let corners_at = some.par_iter().map(|&time_s| corners_in_world(animation, &carried, time_s));
            for (&time_s, corners) in some.iter().zip(corners_at.collect::<Vec<_>>()) {
                // Nothing moves between neighbouring numbers: a step there is a jump.
                let from = before.as_ref().filter(|(then_s, _)| then_s.next_up() < time_s).map(|(_, corners)| corners);
                for (number, (b, at)) in boxes.iter_mut().zip(&corners).enumerate() {
                    *b = grown(*b, from.map_or(&at[..], |from| &from[number]), at);
                }
                before = Some((time_s, corners));
            }
        }
        boxes
    }

    /// The boxes that joints carry: all vertices lie between them.
    fn carried_by(&self, moving: &MovingInstance) -> Vec<Carried> {
        let vertices = self.mesh_of(moving).map_or(&[][..], |mesh| &mesh.vertices);
        let mut boxes = vec![Aabb::EMPTY; moving.joints.len()];
        if moving.influences.is_empty() {
            boxes.truncate(1);
            boxes.fill(Aabb::around(vertices.iter().map(|v| Vec3::from(v.position))));
        }
        for (vertex, influence) in vertices.iter().zip(&moving.influences) {
            for (joint, _) in influence.shares() {
                if let Some(b) = boxes.get_mut(joint) {
                    *b = b.grown_to(vertex.position.into());
                }
            }
        }
        let carried = moving.joints.iter().zip(boxes).filter(|(_, b)| !b.is_empty());
        let in_node = carried.map(|(joint, b)| {
            let corners_in_node = b.corners().map(|c| joint.joint_from_mesh.transform_point3(c.as_dvec3()));
            Carried { node: joint.node, corners_in_node }
        });
        in_node.collect()
    }
}

/// A box that a node carries.
struct Carried {
    node: u32,
    corners_in_node: [DVec3; 8],
}

/// The corners of all boxes of each moving instance at a moment.
fn corners_in_world(animation: &Animation, carried: &[Vec<Carried>], time_s: f32) -> Vec<Vec<DVec3>> {
    let world_from_nodes = animation.world_from_nodes(time_s);
    let corners_of = carried.iter().map(|boxes| {
        let corners = boxes.iter().flat_map(|b| {
            let world_from_node = world_from_nodes.get(b.node as usize).copied().unwrap_or_default();
            b.corners_in_node.map(|corner| world_from_node.transform_point3(corner))
        });
        corners.collect()
    });
    corners_of.collect()
}

/// A box grown to ways from point to point, each half as wide to all sides as it is long.
fn grown(around: Aabb, from: &[DVec3], to: &[DVec3]) -> Aabb {
    from.iter().zip(to).fold(around, |all, (&from, &to)| {
        if !(from.is_finite() && to.is_finite()) {
            return Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
        }
        let aside = DVec3::splat(from.distance(to) * 0.5);
        all.grown_to((from.min(to) - aside).as_vec3()).grown_to((from.max(to) + aside).as_vec3())
    })
}

/// Times at which a clip is sampled, in order: all keys with the numbers before them, and moments between; spread
/// evenly where these are too many.
fn moments(animation: &Animation, most: usize) -> Vec<f32> {
    let (Some(clip), Some(duration_s)) = (animation.clip(), animation.period_s()) else { return vec![0.0] };
    let most = most.clamp(FEWEST_MOMENTS, MOST_MOMENTS);
    let mut keys: Vec<f32> = vec![0.0, duration_s];
    for channel in &clip.channels {
        keys.extend(&channel.times_s);
        keys.sort_unstable_by(f32::total_cmp);
        keys.dedup();
        if keys.len() * (MOMENTS_BETWEEN_KEYS + 2) > most {
            let even = (0..most).map(|i| duration_s * (i as f32 / most as f32));
            return even.chain([duration_s.next_down()]).collect();
        }
    }
    let between = MOMENTS_BETWEEN_KEYS.max(FEW_KEYS_MOMENTS.min(most) / keys.len());
    let moments = keys.windows(2).flat_map(|pair| {
        let inner = (1..=between).map(|i| i as f32 / (between + 1) as f32);
        let inner = inner.map(|share| pair[0] + (pair[1] - pair[0]) * share);
        [pair[0]].into_iter().chain(inner).chain([pair[1].next_down()])
    });
    moments.collect()
}
