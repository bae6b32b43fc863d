//! Triangles collected into a mesh; solids, checks and mirrors made of them; and a mesh as a scene.

use std::f32::consts::{PI, TAU};

use glam::{Affine3A, Vec2, Vec3};

use super::random::Noise;
use crate::{Instance, Material, Mesh, MeshPart, Scene, Vertex};

const LIGHT_CHECK: Vec3 = Vec3::splat(214.0);
const DARK_CHECK: Vec3 = Vec3::new(54.0, 62.0, 74.0);
/// The step to either side from which a normal is computed.
const STEP_RAD: f32 = 1e-3;

/// A place on a beam's axis: the middle of its section, and the direction of the section's top.
#[derive(Clone, Copy)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct Station {
    pub middle: Vec3,
    pub up: Vec3,
}

/// Triangles of one mesh, which end up in parts of one material each.
#[derive(Default)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct MeshBuilder {
    pub vertices: Vec<Vertex>,
    pub indices: Vec<u32>,
    parts: Vec<MeshPart>,
}

/// A vertex without texture coordinates or sway; `color_srgb` in codes of 0 to 255.
#[must_use]
pub fn vertex(position: Vec3, normal: Vec3, color_srgb: Vec3) -> Vertex {
    let [r, g, b] = color_srgb.to_array().map(|c| (c.clamp(0.0, 255.0) + 0.5) as u8);
    Vertex { position: position.into(), normal: normal.into(), uv: [0.0; 2], color_srgba8: [r, g, b, 255], sway: 0.0 }
}

/// A material without highlights, as by default; colours come from the vertices.
#[must_use]
pub fn matt(name: &str) -> Material {
    Material { name: name.into(), ..Material::default() }
}

impl MeshBuilder {
    /// Adds a vertex and returns its number.
    pub fn push(&mut self, vertex: Vertex) -> u32 {
        self.vertices.push(vertex);
        self.vertices.len() as u32 - 1
    }

    /// Adds two triangles through corners that run counter-clockwise, seen from the front.
    pub fn quad(&mut self, corners: [u32; 4]) {
        let [a, b, c, d] = corners;
        self.indices.extend([a, b, c, a, c, d]);
    }

    /// Adds a parallelogram that faces `right × up`, with corners at `centre ± right ± up`.
    pub fn rectangle(&mut self, centre: Vec3, right: Vec3, up: Vec3, color_srgb: Vec3) {
        let normal = right.cross(up).normalize_or(Vec3::Y);
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(r, u): (f32, f32)| {
            let uv = Vec2::new(0.5 + 0.5 * r, 0.5 - 0.5 * u).to_array();
            self.push(Vertex { uv, ..vertex(centre + right * r + up * u, normal, color_srgb) })
        });
        self.quad(corners);
    }

    /// Adds an axis-aligned box: 12 triangles that face out.
    pub fn cuboid(&mut self, min: Vec3, max: Vec3, color_srgb: Vec3) {
        let centre = (min + max) * 0.5;
        let half = (max - min) * 0.5;
        for axis in 0..3 {
            let [out, right, up] = [axis, (axis + 1) % 3, (axis + 2) % 3].map(|a| Vec3::AXES[a] * half[a]);
            self.rectangle(centre + out, right, up, color_srgb);
            self.rectangle(centre - out, up, right, color_srgb);
        }
    }

    /// Adds a flat quadrilateral, its corners counter-clockwise seen from the front.
    pub fn facet(&mut self, corners: [Vec3; 4], color_srgb: Vec3) {
        let [a, b, c, d] = corners;
        let normal = (c - a).cross(d - b).normalize_or(Vec3::Y);
        let corners = corners.map(|corner| self.push(vertex(corner, normal, color_srgb)));
        self.quad(corners);
    }

    /// Joins `rings` of `sides` vertices each, the first of which is `first`, to a tube. A closed one ends where it begins.
    pub(super) fn join_rings(&mut self, first: u32, rings: u32, sides: u32, is_closed: bool) {
        let pieces = if is_closed { rings } else { rings - 1 };
        for ring in 0..pieces {
            for side in 0..sides {
                let near = first + ring * sides;
                let far = first + (ring + 1) % rings * sides;
                let next = (side + 1) % sides;
                self.quad([near + side, near + next, far + next, far + side]);
            }
        }
    }

    /// Sweeps a closed outline around the y axis, through `stations` that turn from +x to +z. The outline runs
    /// counter-clockwise with "away from the axis" to the right and +y up; its surface then faces out.
    pub fn sweep_around(
        &mut self,
        stations: u32,
        outline_points: u32,
        point: impl Fn(u32, u32) -> Vec3,
        mut color_srgb: impl FnMut(u32, u32) -> Vec3,
    ) {
        for station in 0..stations {
            for i in 0..outline_points {
                let after = (station + 1) % stations;
                let next = (i + 1) % outline_points;
                let corners = [point(station, i), point(station, next), point(after, next), point(after, i)];
                self.facet(corners, color_srgb(station, i));
            }
        }
    }

    /// A box beam through two or more stations, closed at its ends: 8 triangles a piece and 4 for the ends.
    pub fn beam(&mut self, stations: &[Station], width_m: f32, depth_m: f32, color_srgb: Vec3) {
        let last = stations.len() - 1;
        let sections: Vec<[Vec3; 4]> = (0..=last)
            .map(|i| {
                let Station { middle, up } = stations[i];
                let along = stations[(i + 1).min(last)].middle - stations[i.saturating_sub(1)].middle;
                let along = along.normalize_or(Vec3::X);
                let side = along.cross(up).normalize_or(along.any_orthonormal_vector());
                let up = side.cross(along) * (0.5 * depth_m);
                let side = side * (0.5 * width_m);
                [middle - side - up, middle + side - up, middle + side + up, middle - side + up]
            })
            .collect();
        for pair in sections.windows(2) {
            for i in 0..4 {
                let next = (i + 1) % 4;
                self.facet([pair[0][i], pair[1][i], pair[1][next], pair[0][next]], color_srgb);
            }
        }
        self.facet(sections[0], color_srgb);
        let [a, b, c, d] = sections[last];
        self.facet([d, c, b, a], color_srgb);
    }

    /// An upright frustum, closed: `4 · sides - 4` triangles.
    pub fn drum(&mut self, foot: Vec3, radii_m: [f32; 2], height_m: f32, sides: u32, color_srgb: Vec3) {
        let corner = |i: u32, top: usize| {
            let (sin, cos) = f32::sin_cos(TAU * (i % sides) as f32 / sides as f32);
            foot + Vec3::new(sin * radii_m[top], height_m * top as f32, cos * radii_m[top])
        };
        for i in 0..sides {
            self.facet([corner(i, 0), corner(i + 1, 0), corner(i + 1, 1), corner(i, 1)], color_srgb);
        }
        for (top, normal) in [(0, Vec3::NEG_Y), (1, Vec3::Y)] {
            let first = self.vertices.len() as u32;
            (0..sides).for_each(|i| {
                self.push(vertex(corner(i, top), normal, color_srgb));
            });
            for i in 1..sides - 1 {
                let [left, right] = if top == 1 { [i, i + 1] } else { [i + 1, i] };
                self.indices.extend([first, first + left, first + right]);
            }
        }
    }

    /// A lumpy ball, such as the crown of a far tree: `2 · columns · (rows - 1)` triangles.
    pub fn lumpy_ball(&mut self, centre: Vec3, radii_m: Vec3, noise: &Noise, color_srgb: Vec3) {
        self.closed([7, 4], |out| {
            let lump = noise.in_space(out * 1.9 + centre);
            let normal = (out / radii_m).normalize_or(Vec3::Y);
            // Darker below, where the crown shades itself.
            let shade = 0.82 + 0.16 * out.y + 0.16 * lump;
            vertex(centre + out * radii_m * (1.0 + 0.24 * lump), normal, color_srgb * shade)
        });
    }

    /// Adds a closed surface around a middle, with a vertex for each direction from there: `2 · columns · (rows - 1)` triangles.
    pub fn closed(&mut self, [columns, rows]: [u32; 2], vertex_towards: impl Fn(Vec3) -> Vertex) {
        let first = self.vertices.len() as u32;
        for row in 0..=rows {
            for column in 0..columns {
                let azimuth = TAU * column as f32 / columns as f32;
                let polar = PI * row as f32 / rows as f32;
                // Each pole is one point.
                let ring = if row % rows == 0 { 0.0 } else { polar.sin() };
                self.push(vertex_towards(Vec3::new(ring * azimuth.sin(), polar.cos(), ring * azimuth.cos())));
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let next = (column + 1) % columns;
                let above = first + row * columns;
                let below = first + (row + 1) * columns;
                if row > 0 {
                    self.indices.extend([above + column, below + column, above + next]);
                }
                if row + 1 < rows {
                    self.indices.extend([above + next, below + column, below + next]);
                }
            }
        }
    }

    /// Adds `cells`² squares of two triangles, the mesh's first; gets a vertex by its column and row, row by row.
    pub fn grid(&mut self, cells: u32, mut vertex: impl FnMut(u32, u32) -> Vertex) {
        let side = cells + 1;
        self.vertices.extend((0..side * side).map(|i| vertex(i % side, i / side)));
        for cell in 0..cells * cells {
            let corner = cell / cells * side + cell % cells;
            self.quad([corner, corner + side, corner + side + 1, corner + 1]);
        }
    }

    /// The triangles so far.
    #[must_use]
    pub fn triangle_count(&self) -> u32 {
        self.indices.len() as u32 / 3
    }

    /// Ends a part of all indices since the last one.
    pub fn finish_part(&mut self, material: u32) {
        let first_index = self.parts.last().map_or(0, |p| p.first_index + p.index_count);
        let index_count = self.indices.len() as u32 - first_index;
        self.parts.push(MeshPart { first_index, index_count, material });
    }

    /// The mesh of all finished parts.
    #[must_use]
    pub fn into_mesh(self) -> Mesh {
        Mesh { vertices: self.vertices, indices: self.indices, parts: self.parts, ..Mesh::default() }
    }

    /// A scene of this mesh alone, in one material, lit.
    #[must_use]
    pub fn into_scene(mut self, name: &str, material: Material) -> Scene {
        self.finish_part(0);
        self.into_scene_of(name, vec![material])
    }

    /// A scene of this mesh alone, whose parts have been finished, lit.
    #[must_use]
    pub fn into_scene_of(self, name: &str, materials: Vec<Material>) -> Scene {
        Scene {
            name: name.into(),
            meshes: vec![self.into_mesh()],
            instances: vec![Instance { mesh: 0, world_from_mesh: Affine3A::IDENTITY }],
            materials,
            ..Scene::default()
        }
        .with_default_lights()
    }
}

/// A metal without roughness.
pub fn mirror(reflectance: f32) -> Material {
    let base_color_linear = [reflectance, reflectance, reflectance, 1.0];
    Material { name: "mirror".into(), base_color_linear, metallic: 1.0, roughness: 0.0, ..Material::default() }
}

/// A floor of 1 m checks at the origin.
pub fn checks(builder: &mut MeshBuilder, half_side_m: u32) {
    let corner = Vec3::new(-1.0, 0.0, -1.0) * half_side_m as f32;
    checked(builder, corner, [Vec3::Z, Vec3::X], [2 * half_side_m; 2]);
}

/// Checks of 1 m from a corner on, to the right and up.
pub fn checked(builder: &mut MeshBuilder, corner: Vec3, [right, up]: [Vec3; 2], [columns, rows]: [u32; 2]) {
    for row in 0..rows {
        for column in 0..columns {
            let middle = corner + right * (column as f32 + 0.5) + up * (row as f32 + 0.5);
            let color_srgb = if (row + column).is_multiple_of(2) { LIGHT_CHECK } else { DARK_CHECK };
            builder.rectangle(middle, right * 0.5, up * 0.5, color_srgb);
        }
    }
}

/// A ball of 3,968 triangles.
pub fn ball(builder: &mut MeshBuilder, middle: Vec3, radius_m: f32, color_srgb: Vec3) {
    star(builder, [64, 32], color_srgb, |out| middle + out * radius_m);
}

/// A closed surface with a point for each direction from its middle, and the normals of the smooth surface.
pub fn star(builder: &mut MeshBuilder, segments: [u32; 2], color_srgb: Vec3, point: impl Fn(Vec3) -> Vec3) {
    builder.closed(segments, |out| vertex(point(out), normal_of(&point, out), color_srgb));
}

/// From differences to two sides.
fn normal_of(point: &impl Fn(Vec3) -> Vec3, out: Vec3) -> Vec3 {
    let right = out.any_orthonormal_vector();
    let up = out.cross(right);
    let [to_right, upwards] = [right, up].map(|aside| {
        let [ahead, behind] = [aside, -aside].map(|step| point((out + step * STEP_RAD).normalize_or(out)));
        ahead - behind
    });
    to_right.cross(upwards).normalize_or(out)
}
