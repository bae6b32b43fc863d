//! Collects triangles into a mesh, and a mesh into a scene.

use glam::{Affine3A, Vec2, Vec3};

use crate::{Instance, Material, Mesh, MeshPart, Scene, Vertex};

#[derive(Default)]
pub(super) struct MeshBuilder {
    pub vertices: Vec<Vertex>,
    pub indices: Vec<u32>,
    parts: Vec<MeshPart>,
}

/// A vertex without texture coordinates or sway; `color_srgb` in codes of 0 to 255.
pub(super) fn vertex(position: Vec3, normal: Vec3, color_srgb: Vec3) -> Vertex {
    let [r, g, b] = color_srgb.to_array().map(|c| (c.clamp(0.0, 255.0) + 0.5) as u8);
    Vertex { position: position.into(), normal: normal.into(), uv: [0.0; 2], color_srgba8: [r, g, b, 255], sway: 0.0 }
}

impl MeshBuilder {
    pub(super) fn push(&mut self, vertex: Vertex) -> u32 {
        self.vertices.push(vertex);
        self.vertices.len() as u32 - 1
    }

    /// Adds two triangles through corners that run counter-clockwise, seen from the front.
    pub(super) fn quad(&mut self, corners: [u32; 4]) {
        let [a, b, c, d] = corners;
        self.indices.extend([a, b, c, a, c, d]);
    }

    /// Adds a parallelogram that faces `right × up`, with corners at `centre ± right ± up`.
    pub(super) fn rectangle(&mut self, centre: Vec3, right: Vec3, up: Vec3, color_srgb: Vec3) {
        let normal = right.cross(up).normalize_or(Vec3::Y);
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(r, u): (f32, f32)| {
            let uv = Vec2::new(0.5 + 0.5 * r, 0.5 - 0.5 * u).to_array();
            self.push(Vertex { uv, ..vertex(centre + right * r + up * u, normal, color_srgb) })
        });
        self.quad(corners);
    }

    /// Adds an axis-aligned box: 12 triangles that face out.
    pub(super) fn cuboid(&mut self, min: Vec3, max: Vec3, color_srgb: Vec3) {
        let (centre, half) = ((min + max) * 0.5, (max - min) * 0.5);
        for axis in 0..3 {
            let side = |a: usize| Vec3::AXES[a] * half[a];
            let (out, right, up) = (side(axis), side((axis + 1) % 3), side((axis + 2) % 3));
            self.rectangle(centre + out, right, up, color_srgb);
            self.rectangle(centre - out, up, right, color_srgb);
        }
    }

    /// Adds a flat quadrilateral, its corners counter-clockwise seen from the front.
    pub(super) fn facet(&mut self, corners: [Vec3; 4], color_srgb: Vec3) {
        let [a, b, c, d] = corners;
        let normal = (c - a).cross(d - b).normalize_or(Vec3::Y);
        let corners = corners.map(|corner| self.push(vertex(corner, normal, color_srgb)));
        self.quad(corners);
    }

    pub(super) fn triangle_count(&self) -> u32 {
        self.indices.len() as u32 / 3
    }

    /// Ends a part of all indices since the last one.
    pub(super) fn finish_part(&mut self, material: u32) {
        let first_index = self.parts.last().map_or(0, |p| p.first_index + p.index_count);
        let index_count = self.indices.len() as u32 - first_index;
        self.parts.push(MeshPart { first_index, index_count, material });
    }

    pub(super) fn into_mesh(self) -> Mesh {
        Mesh { vertices: self.vertices, indices: self.indices, parts: self.parts }
    }

    /// A scene of this mesh alone, in one material, lit.
    pub(super) fn into_scene(mut self, name: &str, material: Material) -> Scene {
        self.finish_part(0);
        self.into_scene_of(name, vec![material])
    }

    /// A scene of this mesh alone, whose parts have been finished, lit.
    pub(super) fn into_scene_of(self, name: &str, materials: Vec<Material>) -> Scene {
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
