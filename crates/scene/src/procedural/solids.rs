//! Closed solids, the parts of several scenes.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use super::mesh_builder::{MeshBuilder, vertex};
use super::noise::Noise;
use crate::Material;

/// A material without highlights; colours come from the vertices.
pub(super) fn matt(name: &str) -> Material {
    Material { name: name.into(), metallic: 0.0, roughness: 1.0, ..Material::default() }
}

/// A point on an ellipse around the y axis, its parameter turning from +x to +z.
pub(super) fn on_ellipse(half_axes_m: glam::Vec2, angle_rad: f32, y_m: f32) -> Vec3 {
    Vec3::new(half_axes_m.x * angle_rad.cos(), y_m, half_axes_m.y * angle_rad.sin())
}

/// Sweeps a closed outline around the y axis, through `stations` that turn from +x to +z. The outline runs
/// counter-clockwise with "away from the axis" to the right and +y up; its surface then faces out.
pub(super) fn sweep_around(
    builder: &mut MeshBuilder,
    stations: u32,
    outline_points: u32,
    point: impl Fn(u32, u32) -> Vec3,
    mut color_srgb: impl FnMut(u32, u32) -> Vec3,
) {
    for station in 0..stations {
        for i in 0..outline_points {
            let (after, next) = ((station + 1) % stations, (i + 1) % outline_points);
            let corners = [point(station, i), point(station, next), point(after, next), point(after, i)];
            builder.facet(corners, color_srgb(station, i));
        }
    }
}

/// A place on a beam's axis: the middle of its section, and the direction of the section's top.
#[derive(Clone, Copy)]
pub(super) struct Station {
    pub middle: Vec3,
    pub up: Vec3,
}

/// A box beam through two or more stations, closed at its ends: 8 triangles a piece and 4 for the ends.
pub(super) fn beam(builder: &mut MeshBuilder, stations: &[Station], width_m: f32, depth_m: f32, color_srgb: Vec3) {
    let last = stations.len() - 1;
    let sections: Vec<[Vec3; 4]> = (0..=last)
        .map(|i| {
            let Station { middle, up } = stations[i];
            let along = stations[(i + 1).min(last)].middle - stations[i.saturating_sub(1)].middle;
            let along = along.normalize_or(Vec3::X);
            let side = along.cross(up).normalize_or(along.any_orthonormal_vector());
            let (side, up) = (side * (0.5 * width_m), side.cross(along) * (0.5 * depth_m));
            [middle - side - up, middle + side - up, middle + side + up, middle - side + up]
        })
        .collect();
    for pair in sections.windows(2) {
        for i in 0..4 {
            let next = (i + 1) % 4;
            builder.facet([pair[0][i], pair[1][i], pair[1][next], pair[0][next]], color_srgb);
        }
    }
    builder.facet(sections[0], color_srgb);
    let [a, b, c, d] = sections[last];
    builder.facet([d, c, b, a], color_srgb);
}

/// An upright frustum, closed: `4 · sides - 4` triangles.
pub(super) fn drum(
    builder: &mut MeshBuilder,
    foot: Vec3,
    radii_m: [f32; 2],
    height_m: f32,
    sides: u32,
    color_srgb: Vec3,
) {
    let corner = |i: u32, top: usize| {
        let (sin, cos) = (TAU * (i % sides) as f32 / sides as f32).sin_cos();
        foot + Vec3::new(sin * radii_m[top], height_m * top as f32, cos * radii_m[top])
    };
    for i in 0..sides {
        builder.facet([corner(i, 0), corner(i + 1, 0), corner(i + 1, 1), corner(i, 1)], color_srgb);
    }
    for (top, normal) in [(0, Vec3::NEG_Y), (1, Vec3::Y)] {
        let first = builder.vertices.len() as u32;
        (0..sides).for_each(|i| {
            builder.push(vertex(corner(i, top), normal, color_srgb));
        });
        for i in 1..sides - 1 {
            let [left, right] = if top == 1 { [i, i + 1] } else { [i + 1, i] };
            builder.indices.extend([first, first + left, first + right]);
        }
    }
}

/// A lumpy ball, such as the crown of a far tree: `2 · columns · (rows - 1)` triangles.
pub(super) fn lumpy_ball(
    builder: &mut MeshBuilder,
    centre: Vec3,
    radii_m: Vec3,
    [columns, rows]: [u32; 2],
    noise: &Noise,
    color_srgb: Vec3,
) {
    let first = builder.vertices.len() as u32;
    for row in 0..=rows {
        for column in 0..columns {
            let (azimuth, polar) = (TAU * column as f32 / columns as f32, PI * row as f32 / rows as f32);
            let ring = if row % rows == 0 { 0.0 } else { polar.sin() };
            let out = Vec3::new(ring * azimuth.sin(), polar.cos(), ring * azimuth.cos());
            let lump = noise.in_space(out * 1.9 + centre);
            let normal = (out / radii_m).normalize_or(Vec3::Y);
            // Darker below, where the crown shades itself.
            let shade = 0.82 + 0.16 * out.y + 0.16 * lump;
            builder.push(vertex(centre + out * radii_m * (1.0 + 0.24 * lump), normal, color_srgb * shade));
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let next = (column + 1) % columns;
            let (above, below) = (first + row * columns, first + (row + 1) * columns);
            if row > 0 {
                builder.indices.extend([above + column, below + column, above + next]);
            }
            if row + 1 < rows {
                builder.indices.extend([above + next, below + column, below + next]);
            }
        }
    }
}
