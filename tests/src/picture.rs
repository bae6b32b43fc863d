//! The check that a picture shows one sample set, the right one.

use std::collections::HashSet;

use client::Frame;
use cluster::Refinement;

use crate::scalar_engine::{FLOOR_LINEAR, SKY_LINEAR, ball_linear, srgb8};

/// The fault of a frame of the scalar device, if any. The ball must show this time and step and no other; floor and sky
/// must be there, and no other colour.
#[must_use]
pub fn fault_of(frame: &Frame, scene_time_s: f32, refinement: Refinement) -> Option<String> {
    let right = [ball_linear(scene_time_s, refinement), FLOOR_LINEAR, SKY_LINEAR].map(srgb8);
    let seen: HashSet<[u8; 3]> = frame.view.srgb8.as_chunks::<3>().0.iter().copied().collect();
    let strange = seen.iter().find(|color| !right.contains(color));
    let number = frame.request.frame;
    match strange {
        Some(color) => Some(format!("frame {number} shows {color:?} at {scene_time_s} s")),
        None if seen.len() < right.len() => Some(format!("frame {number} lacks ball, floor or sky")),
        None => None,
    }
}
