//! What the paper's images by projected vertices would miss: edges are drawn straight between moved vertices, and the true ones
//! bow.

use depth_image::SinglePoleCamera;
use glam::Vec2;
use report::{Axis, Series, XyChart};

/// Lengths of edges across the radius, and their distances from the pole.
const EDGES_PX: [f32; 6] = [4.0, 8.0, 16.0, 32.0, 64.0, 128.0];
const FROM_POLE_PX: f32 = 100.0;

/// Edges at the middle of the camera's depths.
///
/// # Errors
/// The camera does not see such an edge.
pub fn measure(camera: &SinglePoleCamera) -> anyhow::Result<XyChart> {
    let depth_m = 0.5 * (camera.reference.near_m + camera.farthest_m);
    let shift_px = camera.bend_px_m() * (camera.reference.near_m.recip() - depth_m.recip());
    let (mut drawn, mut closed_form) = (Vec::new(), Vec::new());
    for edge_px in EDGES_PX {
        let end = |along_px: f32| {
            let pixel = camera.pole_px + Vec2::new(FROM_POLE_PX, along_px);
            let seen = camera.project(camera.reference.ray(pixel).at(depth_m));
            seen.map(|at| at.pixel).ok_or_else(|| anyhow::anyhow!("an edge of {edge_px} px is not seen"))
        };
        let straight = 0.5 * (end(-0.5 * edge_px)? + end(0.5 * edge_px)?);
        drawn.push((f64::from(edge_px), f64::from(straight.distance(end(0.0)?))));
        let bow_px = shift_px * edge_px * edge_px / (8.0 * FROM_POLE_PX * FROM_POLE_PX);
        closed_form.push((f64::from(edge_px), f64::from(bow_px)));
    }
    let [x, y] = [Axis::log("edge", "px"), Axis::log("bow that is not drawn", "px")];
    Ok(XyChart::new("Images by projected vertices: edges 100 px from the pole", x, y)
        .with(Series::line("straight between moved vertices", drawn))
        .with(Series::line("D · L² / (8 ρ²)", closed_form)))
}
