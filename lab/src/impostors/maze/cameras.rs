//! Cameras of a maze: graph cameras through its corridors, and pinholes above it.

use anyhow::Context as _;
use depth_image::{Camera, PinholeCamera};
use fixtures::{MAZE_WALL_M, Maze};
use glam::{UVec2, Vec3};

use super::rooms::{Rooms, Surface};
use crate::graph::{GraphCamera, GraphPlan, Layout, through};

/// The size of the paper's graph image.
pub const NESTED_PX: UVec2 = UVec2::new(1920, 1175);
/// Pinholes above the maze: their elevation, distance from the middle and size.
const ELEVATION_DEG: f32 = 60.0;
const DISTANCE_M: f32 = 12.0;
const PINHOLE_PX: UVec2 = UVec2::splat(752);

fn plan(rooms: &Rooms<'_>) -> anyhow::Result<GraphPlan> {
    through(&rooms.portals, NESTED_PX).context("a maze has corridors")
}

/// One continuous image.
///
/// # Errors
/// The camera's frusta cannot be used.
pub fn nested(maze: &Maze) -> anyhow::Result<GraphCamera> {
    Ok(GraphCamera::new(&plan(&Rooms::new(maze))?, &Layout::Nested)?)
}

/// A rectangle for each frustum, with as many texels together.
///
/// # Errors
/// The camera's frusta cannot be used.
pub fn apart(maze: &Maze) -> anyhow::Result<GraphCamera> {
    let rooms = Rooms::new(maze);
    let all_m2: f64 = rooms.surfaces.iter().map(Surface::area_m2).sum();
    let sizes_px = rooms.surfaces.iter().map(|surface| {
        let texels = f64::from(NESTED_PX.element_product()) * surface.area_m2() / all_m2;
        let columns = (texels * surface.columns_over_rows()).sqrt();
        UVec2::new(columns.round() as u32, (texels / columns).round() as u32).max(UVec2::splat(2))
    });
    Ok(GraphCamera::new(&plan(&rooms)?, &Layout::Apart(sizes_px.collect()))?)
}

/// Four pinholes over the corners of the maze, which see all of it.
pub fn above(maze: &Maze) -> Vec<Camera> {
    let target = Vec3::Y * (0.5 * maze.height_m);
    let cameras = (0..4).map(|corner| {
        let azimuth = std::f32::consts::FRAC_PI_4 + std::f32::consts::FRAC_PI_2 * corner as f32;
        let out = Vec3::Z.rotate_y(azimuth);
        let elevation = ELEVATION_DEG.to_radians();
        let eye = target + (out * elevation.cos() + Vec3::Y * elevation.sin()) * DISTANCE_M;
        let half_angle = maze_radius_m(maze) / DISTANCE_M;
        PinholeCamera::looking_at(eye, target, Vec3::Y, 2.0 * half_angle.asin(), PINHOLE_PX).into()
    });
    cameras.collect()
}

/// Of the ball around the maze.
fn maze_radius_m(maze: &Maze) -> f32 {
    let half_m = 0.5 * (fixtures::MAZE_SIDE as f32 + MAZE_WALL_M);
    Vec3::new(half_m, 0.5 * maze.height_m, half_m).length()
}
