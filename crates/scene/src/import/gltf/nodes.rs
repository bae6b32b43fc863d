//! The node tree: the places of meshes, lights and cameras.

use std::collections::{BTreeMap, HashSet};
use std::ops::Range;

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, DVec4, Mat4, Quat, Vec3};
use gltf::json::accessor::Accessor;
use gltf::json::{Index, Node, Root, Scene as JsonScene};
use serde::Deserialize;

use super::super::{PlacedCamera, SourceInstance, SourceScene};
use super::json::chosen_scene;
use super::meshes::Meshes;
use super::{Document, lights, parsed};
use crate::{Fault, TransformParts, at_most, is_invertible};

/// Walks the default scene, else the first, else all nodes without a parent. A node reached twice is in a cycle or has
/// two parents; glTF allows neither.
pub(super) fn read(document: &Document, meshes: &Meshes, scene: &mut SourceScene) -> Result<NodeTree, Fault> {
    let root = document.root;
    let mut is_visited = vec![false; root.nodes.len()];
    let mut tree = NodeTree::default();
    let mut pending: Vec<Pending> = roots(root)?.into_iter().map(Pending::root).collect();
    while let Some(Pending { index, parent, source_from_parent, depth, is_visible }) = pending.pop() {
        let element = format!("node {}", index.value());
        let node = root.get(index).ok_or_else(|| Fault::malformed(&element, "it does not exist"))?;
        at_most(format!("{element}, depth"), u64::from(depth), document.limits.node_depth.into())?;
        if std::mem::replace(&mut is_visited[index.value()], true) {
            return Err(Fault::malformed(element, "it is reached twice: a cycle, or two parents"));
        }
        let source_from_node = source_from_parent * parent_from_node(node, &element)?;
        let is_visible = is_visible && !is_hidden(node);
        let first_instance = scene.instances.len();
        let place = Place { element, source_from_node };
        if is_visible {
            place_mesh(document, meshes, node, &place, scene, &mut tree)?;
            if let Some(light) = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref()) {
                scene.lights.extend(lights::placed(document, light.light, &place.element, source_from_node)?);
            }
        }
        if node.camera.is_some() {
            scene.cameras.extend(placed_camera(document, node, &place)?);
        }
        let instances = first_instance..scene.instances.len();
        pending.extend(node.children.iter().flatten().map(|&index| Pending {
            index,
            parent: Some(tree.nodes.len()),
            source_from_parent: source_from_node,
            depth: depth + 1,
            is_visible,
        }));
        tree.nodes.push(PlacedNode { number: index.value(), parent, instances, source_from_node });
    }
    Ok(tree)
}

/// A node that is still to be placed.
struct Pending {
    index: Index<Node>,
    /// The parent's place in [`NodeTree::nodes`].
    parent: Option<usize>,
    source_from_parent: DAffine3,
    depth: u32,
    /// Whether all nodes above it are visible.
    is_visible: bool,
}

impl Pending {
    fn root(index: Index<Node>) -> Self {
        Self { index, parent: None, source_from_parent: DAffine3::IDENTITY, depth: 0, is_visible: true }
    }
}

/// The nodes of the scene; parents come before their children.
#[derive(Default)]
pub(super) struct NodeTree {
    pub nodes: Vec<PlacedNode>,
    /// The transform of each placement of a mesh to its node.
    pub node_from_instance: Vec<DAffine3>,
}

/// A node of the scene at rest.
pub(super) struct PlacedNode {
    /// The file's number of the node.
    pub number: usize,
    /// The parent's place in [`NodeTree::nodes`].
    pub parent: Option<usize>,
    /// The placements of its mesh, if it has triangles. They need not be invertible.
    pub instances: Range<usize>,
    pub source_from_node: DAffine3,
}

fn roots(root: &Root) -> Result<Vec<Index<Node>>, Fault> {
    if let Some(index) = chosen_scene(root) {
        let scene: Option<&JsonScene> = root.get(index);
        return scene.map(|s| s.nodes.clone()).ok_or_else(|| Fault::malformed("default scene", "it does not exist"));
    }
    let children = root.nodes.iter().flat_map(|n| n.children.iter().flatten());
    let children: HashSet<usize> = children.map(|child| child.value()).collect();
    Ok((0..root.nodes.len()).filter(|i| !children.contains(i)).map(|i| Index::new(i as u32)).collect())
}

/// Whether `KHR_node_visibility` hides a node, and with it all nodes below.
fn is_hidden(node: &Node) -> bool {
    let extension = node.extensions.as_ref().and_then(|extensions| extensions.others.get("KHR_node_visibility"));
    extension.and_then(|extension| extension.get("visible")?.as_bool()) == Some(false)
}

/// A node's name in messages, and its transform.
struct Place {
    element: String,
    source_from_node: DAffine3,
}

fn place_mesh(
    document: &Document,
    meshes: &Meshes,
    node: &Node,
    place: &Place,
    scene: &mut SourceScene,
    tree: &mut NodeTree,
) -> Result<(), Fault> {
    let Some(number) = node.mesh.map(|mesh| mesh.value()) else { return Ok(()) };
    let Some(mesh) = meshes.number(node) else {
        return Err(Fault::malformed(&place.element, format!("mesh {number} does not exist")));
    };
    if scene.meshes[mesh].indices.is_empty() {
        return Ok(());
    }
    let left = document.limits.instances.saturating_sub(scene.instances.len() as u64);
    for node_from_instance in placements(document, node, &place.element, left)? {
        let source_from_mesh = place.source_from_node * node_from_instance;
        if !source_from_mesh.is_finite() {
            return Err(Fault::malformed(&place.element, "its transform is not finite"));
        }
        scene.instances.push(SourceInstance { mesh, source_from_mesh });
        tree.node_from_instance.push(node_from_instance);
    }
    Ok(())
}

/// `None`, with a warning, for an orthographic camera, and for one whose node or field of view has no size. The pose is
/// rigid: a node's scale does not affect a view.
fn placed_camera(document: &Document, node: &Node, place: &Place) -> Result<Option<PlacedCamera>, Fault> {
    let camera = node.camera.and_then(|index| document.root.get(index));
    let camera = camera.ok_or_else(|| Fault::malformed(&place.element, "its camera does not exist"))?;
    let name = camera.name.clone().or_else(|| node.name.clone());
    let name = name.unwrap_or_else(|| format!("camera {}", node.camera.map_or(0, |c| c.value())));
    let element = format_args!("{}, camera {name:?}", place.element);
    let Some(perspective) = &camera.perspective else {
        document.warnings.count("orthographic cameras are left out", element);
        return Ok(None);
    };
    let is_open = perspective.yfov > 0.0 && perspective.yfov < std::f32::consts::PI;
    if !(is_open && is_invertible(&place.source_from_node)) {
        let warning = "cameras whose transform has no inverse, or field of view no size, are left out";
        document.warnings.count(warning, element);
        return Ok(None);
    }
    let backwards = (place.source_from_node.matrix3 * DVec3::Z).normalize_or(DVec3::Z);
    let right = (place.source_from_node.matrix3 * DVec3::Y).cross(backwards).normalize_or(DVec3::X);
    let rotation = DMat3::from_cols(right, backwards.cross(right), backwards);
    Ok(Some(PlacedCamera {
        name,
        source_from_camera: DAffine3::from_mat3_translation(rotation, place.source_from_node.translation),
        fov_y_rad: perspective.yfov,
    }))
}

/// A node's transform to its parent. It need not have an inverse.
pub(super) fn parent_from_node(node: &Node, element: &str) -> Result<DAffine3, Fault> {
    let transform = match node.matrix {
        Some(matrix) => affine_from(Mat4::from_cols_array(&matrix).as_dmat4()),
        None => {
            let parts = parts_of(node);
            let length = parts.rotation.as_dquat().length();
            (length > 1e-6 && length.is_finite()).then(|| parts.parent_from_node())
        }
    };
    let transform = transform.filter(DAffine3::is_finite);
    transform.ok_or_else(|| Fault::malformed(element, "its transform is not finite, not affine, or has no rotation"))
}

/// `None` for a matrix that is not affine. Exporters write zeros alone to hide something.
pub(super) fn affine_from(matrix: DMat4) -> Option<DAffine3> {
    if matrix == DMat4::ZERO {
        return Some(DAffine3 { matrix3: DMat3::ZERO, translation: DVec3::ZERO });
    }
    let is_affine = (matrix.row(3) - DVec4::W).abs().max_element() < 1e-6;
    is_affine.then(|| DAffine3::from_mat4(matrix))
}

/// The parts of a node's transform as in the file; a rotation may have any length.
pub(super) fn parts_of(node: &Node) -> TransformParts {
    TransformParts {
        translation: node.translation.map_or(Vec3::ZERO, Vec3::from),
        rotation: node.rotation.map_or(Quat::IDENTITY, |r| Quat::from_array(r.0)),
        scale: node.scale.map_or(Vec3::ONE, Vec3::from),
    }
}

const INSTANCING: &str = "EXT_mesh_gpu_instancing";

/// The JSON of `EXT_mesh_gpu_instancing`, by which a node places its mesh many times. Further attributes are of applications.
#[derive(Deserialize)]
struct Instancing {
    attributes: BTreeMap<String, Index<Accessor>>,
}

/// The transforms from each placement to its node; the identity alone for a node without the extension. `element` names the
/// node. At most `limit` are read.
fn placements(document: &Document, node: &Node, element: &str, limit: u64) -> Result<Vec<DAffine3>, Fault> {
    let extension = node.extensions.as_ref().and_then(|extensions| extensions.others.get(INSTANCING));
    let Some(extension) = extension else { return Ok(vec![DAffine3::IDENTITY]) };
    let element = format!("{element}, {INSTANCING}");
    let Instancing { attributes } = parsed(extension, &element)?;
    let parts = ["TRANSLATION", "ROTATION", "SCALE"].map(|name| attributes.get(name).copied());
    let Some(&first) = parts.iter().flatten().next() else { return Ok(vec![DAffine3::IDENTITY]) };
    let count = document.layout(first, &element)?.count;
    at_most(format_args!("{element}: instances"), count, limit)?;
    let translations = values(document, parts[0], [0.0; 3], count, &element)?;
    let scales = values(document, parts[2], [1.0; 3], count, &element)?;
    let rotations = values(document, parts[1], Quat::IDENTITY.to_array(), count, &element)?;
    if translations.len() != rotations.len() || rotations.len() != scales.len() {
        return Err(Fault::malformed(element, "its attributes have different counts"));
    }
    let places = translations.into_iter().zip(rotations).zip(scales).map(|((translation, rotation), scale)| {
        let rotation = Quat::from_array(rotation).as_dquat();
        let unit = if rotation.length() > 1e-6 { rotation.normalize() } else { DQuat::IDENTITY };
        let [scale, translation] = [scale, translation].map(|v| Vec3::from(v).as_dvec3());
        DAffine3::from_scale_rotation_translation(scale, unit, translation)
    });
    let places: Vec<DAffine3> = places.collect();
    match places.iter().position(|place| !place.is_finite()) {
        Some(bad) => Err(Fault::malformed(element, format!("instance {bad} is not finite"))),
        None => Ok(places),
    }
}

/// The values of an attribute; `count` times the default for an attribute that is not there.
fn values<const N: usize>(
    document: &Document,
    index: Option<Index<Accessor>>,
    default: [f32; N],
    count: u64,
    element: &str,
) -> Result<Vec<[f32; N]>, Fault> {
    index.map_or_else(|| Ok(vec![default; count as usize]), |index| document.floats(index, element))
}
