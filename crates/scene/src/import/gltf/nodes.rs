//! The node tree: the places of meshes, lights and cameras.

use std::collections::HashSet;

use glam::{DAffine3, DMat4, DVec3, Mat4, Quat, Vec3};
use gltf::json::{Index, Node, Root, Scene as JsonScene};

use super::super::source_scene::{PlacedCamera, SourceInstance, SourceScene};
use super::lights;
use crate::Limits;
use crate::animation::{TransformParts, is_invertible};
use crate::error::{Fault, at_most};

/// Walks the default scene, else the first, else all nodes without a parent. A node reached twice is in a cycle or has
/// two parents; glTF allows neither.
pub(super) fn read(root: &Root, limits: &Limits, scene: &mut SourceScene) -> Result<NodeTree, Fault> {
    let mut is_visited = vec![false; root.nodes.len()];
    let mut tree = NodeTree::default();
    let mut pending: Vec<_> = roots(root)?.into_iter().map(|node| (node, None, DAffine3::IDENTITY, 0u32)).collect();
    while let Some((index, parent, source_from_parent, depth)) = pending.pop() {
        let element = format!("node {}", index.value());
        let node = root.get(index).ok_or_else(|| Fault::malformed(&element, "it does not exist"))?;
        at_most(format!("{element}, depth"), u64::from(depth), limits.node_depth.into())?;
        if std::mem::replace(&mut is_visited[index.value()], true) {
            return Err(Fault::malformed(element, "it is reached twice: a cycle, or two parents"));
        }
        let source_from_node = source_from_parent * parent_from_node(node, &element)?;
        let instance = scene.instances.len();
        add_contents(root, node, &Place { element, source_from_node }, scene)?;
        let instance = (scene.instances.len() > instance).then_some(instance);
        let children = node.children.iter().flatten();
        pending.extend(children.map(|&child| (child, Some(tree.nodes.len()), source_from_node, depth + 1)));
        tree.nodes.push(PlacedNode { number: index.value(), parent, instance, source_from_node });
    }
    Ok(tree)
}

/// The nodes of the scene; parents come before their children.
#[derive(Default)]
pub(super) struct NodeTree {
    pub nodes: Vec<PlacedNode>,
}

/// A node of the scene at rest.
pub(super) struct PlacedNode {
    /// In the file.
    pub number: usize,
    /// In the tree.
    pub parent: Option<usize>,
    /// The placement of its mesh, if it has triangles. Whether it has to be invertible depends on clips and skins.
    pub instance: Option<usize>,
    pub source_from_node: DAffine3,
}

fn roots(root: &Root) -> Result<Vec<Index<Node>>, Fault> {
    let chosen = root.scene.or((!root.scenes.is_empty()).then(|| Index::new(0)));
    if let Some(index) = chosen {
        let scene: Option<&JsonScene> = root.get(index);
        return scene.map(|s| s.nodes.clone()).ok_or_else(|| Fault::malformed("default scene", "it does not exist"));
    }
    let children = root.nodes.iter().flat_map(|n| n.children.iter().flatten());
    let children: HashSet<usize> = children.map(|child| child.value()).collect();
    Ok((0..root.nodes.len()).filter(|i| !children.contains(i)).map(|i| Index::new(i as u32)).collect())
}

/// A node's name in messages, and its transform.
struct Place {
    element: String,
    source_from_node: DAffine3,
}

impl Place {
    fn require_invertible(&self) -> Result<(), Fault> {
        let singular = || Fault::malformed(&self.element, "its transform is singular or not finite");
        is_invertible(&self.source_from_node).then_some(()).ok_or_else(singular)
    }
}

fn add_contents(root: &Root, node: &Node, place: &Place, scene: &mut SourceScene) -> Result<(), Fault> {
    if let Some(mesh) = node.mesh.map(|mesh| mesh.value()) {
        let missing = || Fault::malformed(&place.element, format!("mesh {mesh} does not exist"));
        if !scene.meshes.get(mesh).ok_or_else(missing)?.indices.is_empty() {
            scene.instances.push(SourceInstance { mesh, source_from_mesh: place.source_from_node });
        }
    }
    if let Some(light) = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref()) {
        scene.lights.push(lights::placed(root, light.light, &place.source_from_node, &place.element)?);
    }
    if node.camera.is_some() {
        scene.cameras.extend(placed_camera(root, node, place)?);
    }
    Ok(())
}

pub(super) fn parent_from_node(node: &Node, element: &str) -> Result<DAffine3, Fault> {
    let transform = match node.matrix {
        Some(matrix) => affine_from(Mat4::from_cols_array(&matrix).as_dmat4()),
        None => from_parts(node),
    };
    let transform = transform.filter(DAffine3::is_finite);
    transform.ok_or_else(|| Fault::malformed(element, "its transform is not finite, not affine, or has no rotation"))
}

pub(super) fn affine_from(matrix: DMat4) -> Option<DAffine3> {
    let is_affine = (matrix.row(3) - glam::DVec4::W).abs().max_element() < 1e-6;
    is_affine.then(|| DAffine3::from_mat4(matrix))
}

fn from_parts(node: &Node) -> Option<DAffine3> {
    let parts = parts_of(node);
    let length = parts.rotation.as_dquat().length();
    (length > 1e-6 && length.is_finite()).then(|| parts.parent_from_node())
}

/// The parts of a node's transform as in the file; a rotation may have any length.
pub(super) fn parts_of(node: &Node) -> TransformParts {
    TransformParts {
        translation: node.translation.map_or(Vec3::ZERO, Vec3::from),
        rotation: node.rotation.map_or(Quat::IDENTITY, |r| Quat::from_array(r.0)),
        scale: node.scale.map_or(Vec3::ONE, Vec3::from),
    }
}

/// `None` for an orthographic camera. The pose is rigid: a node's scale does not affect a view.
fn placed_camera(root: &Root, node: &Node, place: &Place) -> Result<Option<PlacedCamera>, Fault> {
    let camera = node.camera.and_then(|index| root.get(index));
    let camera = camera.ok_or_else(|| Fault::malformed(&place.element, "its camera does not exist"))?;
    let Some(perspective) = &camera.perspective else {
        return Ok(None);
    };
    place.require_invertible()?;
    let backwards = (place.source_from_node.matrix3 * DVec3::Z).normalize_or(DVec3::Z);
    let right = (place.source_from_node.matrix3 * DVec3::Y).cross(backwards).normalize_or(DVec3::X);
    let rotation = glam::DMat3::from_cols(right, backwards.cross(right), backwards);
    let fallback = || format!("camera {}", node.camera.map_or(0, |c| c.value()));
    Ok(Some(PlacedCamera {
        name: camera.name.clone().or_else(|| node.name.clone()).unwrap_or_else(fallback),
        source_from_camera: DAffine3::from_mat3_translation(rotation, place.source_from_node.translation),
        fov_y_rad: perspective.yfov,
    }))
}
