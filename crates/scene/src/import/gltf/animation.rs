//! The moving part of a scene: instances below nodes that clips move, and skinned meshes. Placements without an inverse: those
//! that flatten a mesh, and those that leave no area of it.

use glam::{DAffine3, DMat3, DVec3, Mat4};
use gltf::json::{Index, Node as JsonNode, skin::Skin};

use super::super::{SourceMesh, SourceScene};
use super::nodes::{NodeTree, PlacedNode, affine_from, parent_from_node, parts_of};
use super::{Document, channels};
use crate::{
    Animation, Clip, Fault, Influence, Joint, Limits, MovingInstance, Node, NodeTransform, TransformParts, at_most,
    is_invertible,
};

/// Reads clips and skins. A scene in which no mesh follows them has no animation.
pub(super) fn read(document: &Document, tree: &NodeTree, scene: &mut SourceScene) -> Result<(), Fault> {
    let clips = channels::read(document)?;
    let mut placements = Placements::read(document, tree, &clips, scene)?;
    settle(&mut placements, scene, document.limits)?;
    let moving = placements.moving;
    if moving.is_empty() {
        return Ok(());
    }
    let mut animation = Animation { clips, moving, ..Animation::default() };
    animation.playing = (!animation.clips.is_empty()).then_some(0);
    keep_needed_nodes(document, tree, &mut animation)?;
    scene.animation = Some(animation);
    Ok(())
}

/// The placements of meshes that need more than a transform.
#[derive(Default)]
struct Placements {
    /// All instances that move or are skinned. `Joint::node` is the node's place in the tree.
    moving: Vec<MovingInstance>,
    /// The numbers of instances that stand still and whose transform has no inverse.
    degenerate: Vec<usize>,
}

impl Placements {
    fn read(document: &Document, tree: &NodeTree, clips: &[Clip], scene: &mut SourceScene) -> Result<Self, Fault> {
        // Whether each node of the tree is moved by some clip, itself or with its parents.
        let is_target = targets(document, clips);
        let mut moves: Vec<bool> = Vec::with_capacity(tree.nodes.len());
        for node in &tree.nodes {
            moves.push(is_target[node.number] || node.parent.is_some_and(|parent| moves[parent]));
        }
        let mut skins = Skins::of(document, tree);
        let mut placements = Self::default();
        for (place, node) in (0u32..).zip(&tree.nodes) {
            for number in node.instances.clone() {
                let instance = &mut scene.instances[number];
                let mesh = &scene.meshes[instance.mesh];
                // A mesh without joints is rigid.
                let skin = document.root.nodes[node.number].skin.filter(|_| !mesh.influences.is_empty());
                if let Some(skin) = skin {
                    let (joints, influences) = skins.skinned(skin, mesh, node, place)?;
                    instance.source_from_mesh = at_rest(tree, &joints, &format!("skin {}", skin.value()))?;
                    placements.moving.push(MovingInstance { instance: number as u32, joints, influences });
                } else if moves[place as usize] {
                    // A clip may grow what has no size at rest: only the place at rest is left.
                    let at_rest = &mut instance.source_from_mesh;
                    if !is_invertible(at_rest) {
                        *at_rest = DAffine3::from_translation(at_rest.translation);
                    }
                    let joints = vec![Joint { node: place, joint_from_mesh: tree.node_from_instance[number] }];
                    placements.moving.push(MovingInstance { instance: number as u32, joints, influences: Vec::new() });
                } else if !is_invertible(&instance.source_from_mesh) {
                    placements.degenerate.push(number);
                }
            }
        }
        Ok(placements)
    }
}

/// Reads skins. What all skinned meshes take is counted, for a small file may place one mesh often.
struct Skins<'d> {
    document: &'d Document<'d>,
    /// The place of each node of the file; `None` for a node outside of the chosen scene.
    place_in_tree: Vec<Option<u32>>,
    joints_left: u64,
    influences_left: u64,
}

impl<'d> Skins<'d> {
    fn of(document: &'d Document<'d>, tree: &NodeTree) -> Self {
        let mut place_in_tree = vec![None; document.root.nodes.len()];
        tree.nodes.iter().zip(0..).for_each(|(node, place)| place_in_tree[node.number] = Some(place));
        Self { document, place_in_tree, joints_left: document.limits.nodes, influences_left: document.limits.vertices }
    }

    /// The joints of a skin and of each vertex of a mesh. Vertices without weights follow the mesh's own node, which is then
    /// the last joint; `place` is its place in the tree.
    fn skinned(
        &mut self,
        index: Index<Skin>,
        mesh: &SourceMesh,
        node: &PlacedNode,
        place: u32,
    ) -> Result<(Vec<Joint>, Vec<Influence>), Fault> {
        let node = format!("node {}", node.number);
        let skin = self.document.root.get(index);
        let skin = skin.ok_or_else(|| Fault::malformed(&node, format!("skin {} does not exist", index.value())))?;
        let joint_count = skin.joints.len() as u64 + 1;
        let vertices = mesh.vertices.len() as u64;
        at_most(format_args!("{node}, joints of all skinned meshes"), joint_count, self.joints_left)?;
        at_most(format_args!("{node}, vertices of all skinned meshes"), vertices, self.influences_left)?;
        self.joints_left -= joint_count;
        self.influences_left -= vertices;
        let element = format!("skin {}", index.value());
        let matrices = bind_matrices(self.document, skin, &element)?;
        for (vertex, influence) in mesh.influences.iter().enumerate() {
            if let Some((joint, _)) = influence.shares().find(|(joint, _)| *joint >= skin.joints.len()) {
                let why = format!("joint {joint} is beyond the skin's {}", skin.joints.len());
                return Err(Fault::malformed(format_args!("{element}, vertex {vertex}"), why));
            }
        }
        let mut joints = Vec::with_capacity(skin.joints.len());
        for (number, (joint, joint_from_mesh)) in skin.joints.iter().zip(matrices).enumerate() {
            let Some(node) = self.place_in_tree.get(joint.value()).copied().flatten() else {
                let why = format!("node {} is not in the scene, or in a cycle", joint.value());
                return Err(Fault::malformed(format_args!("{element}, joint {number}"), why));
            };
            joints.push(Joint { node, joint_from_mesh });
        }
        let rigid = Influence { joints: [joints.len() as u16, 0, 0, 0], weights: [1.0, 0.0, 0.0, 0.0] };
        let mut influences = mesh.influences.clone();
        let mut is_rigid_somewhere = false;
        for influence in influences.iter_mut().filter(|influence| influence.shares().next().is_none()) {
            *influence = rigid;
            is_rigid_somewhere = true;
        }
        if is_rigid_somewhere {
            joints.push(Joint { node: place, joint_from_mesh: DAffine3::IDENTITY });
        }
        Ok((joints, influences))
    }
}

/// Whether each node of the file is the target of a channel. A channel's node exists.
fn targets(document: &Document, clips: &[Clip]) -> Vec<bool> {
    let mut is_target = vec![false; document.root.nodes.len()];
    clips.iter().flat_map(|clip| &clip.channels).for_each(|channel| is_target[channel.node as usize] = true);
    is_target
}

/// The placement at rest by the first joint whose scale is not 0: most skins are bound at rest, where all joints agree.
/// If there is none, the placement is the place of the first joint.
fn at_rest(tree: &NodeTree, joints: &[Joint], element: &str) -> Result<DAffine3, Fault> {
    let first_place = joints.first().map(|joint| tree.nodes[joint.node as usize].source_from_node.translation);
    let first_place = first_place.filter(|place| place.is_finite()).map(DAffine3::from_translation);
    let mut placed =
        joints.iter().map(|joint| tree.nodes[joint.node as usize].source_from_node * joint.joint_from_mesh);
    placed
        .find(is_invertible)
        .or(first_place)
        .ok_or_else(|| Fault::malformed(element, "the transforms of all its joints are not finite"))
}

/// Copies the nodes that joints follow, with all above them, and renumbers joints and channels. Channels of other nodes
/// are dropped.
fn keep_needed_nodes(document: &Document, tree: &NodeTree, animation: &mut Animation) -> Result<(), Fault> {
    let mut is_needed = vec![false; tree.nodes.len()];
    let joints = animation.moving.iter().flat_map(|moving| &moving.joints);
    joints.for_each(|joint| is_needed[joint.node as usize] = true);
    // Parents come before their children: from the last node on, all that need a parent are known.
    for place in (0..tree.nodes.len()).rev() {
        if let Some(parent) = tree.nodes[place].parent.filter(|_| is_needed[place]) {
            is_needed[parent] = true;
        }
    }
    let is_target = targets(document, &animation.clips);
    let mut new_number = vec![u32::MAX; tree.nodes.len()];
    let mut number_of_file = vec![None; document.root.nodes.len()];
    for (place, PlacedNode { number, parent, .. }) in
        tree.nodes.iter().enumerate().filter(|(place, _)| is_needed[*place])
    {
        let rest = rest_of(&document.root.nodes[*number], is_target[*number], &format!("node {number}"))?;
        new_number[place] = animation.nodes.len() as u32;
        number_of_file[*number] = Some(new_number[place]);
        animation.nodes.push(Node { parent: parent.map(|parent| new_number[parent]), rest });
    }
    let joints = animation.moving.iter_mut().flat_map(|moving| &mut moving.joints);
    joints.for_each(|joint| joint.node = new_number[joint.node as usize]);
    for clip in &mut animation.clips {
        clip.channels.retain_mut(|channel| {
            let number = number_of_file[channel.node as usize];
            number.inspect(|&number| channel.node = number).is_some()
        });
    }
    Ok(())
}

/// A node's transform at rest: in parts where a channel moves it.
fn rest_of(node: &JsonNode, is_target: bool, element: &str) -> Result<NodeTransform, Fault> {
    let parent_from_node = parent_from_node(node, element)?;
    if !is_target {
        return Ok(NodeTransform::Fixed(parent_from_node));
    }
    let parts = if node.matrix.is_some() { TransformParts::of(&parent_from_node) } else { parts_of(node) };
    // Its length has been checked.
    Ok(NodeTransform::Parts(TransformParts { rotation: parts.rotation.normalize(), ..parts }))
}

/// The inverse bind matrices of a skin, one for each of its joints. Those without an inverse hide their vertices.
fn bind_matrices(document: &Document, skin: &Skin, element: &str) -> Result<Vec<DAffine3>, Fault> {
    at_most(format_args!("{element}, joints"), skin.joints.len() as u64, u64::from(u16::MAX))?;
    if skin.joints.is_empty() {
        return Err(Fault::malformed(element, "it has no joints"));
    }
    let Some(index) = skin.inverse_bind_matrices else { return Ok(vec![DAffine3::IDENTITY; skin.joints.len()]) };
    let element = format!("{element}, inverseBindMatrices");
    at_most(format_args!("{element}, matrices"), document.layout(index, &element)?.count, u64::from(u16::MAX))?;
    let matrices = document.floats::<16>(index, &element)?;
    if matrices.len() < skin.joints.len() {
        let why = format!("{} matrices for {} joints", matrices.len(), skin.joints.len());
        return Err(Fault::malformed(element, why));
    }
    let mut transforms = Vec::with_capacity(skin.joints.len());
    for (number, matrix) in matrices.iter().take(skin.joints.len()).enumerate() {
        let place = format_args!("{element}, matrix {number}");
        let transform = affine_from(Mat4::from_cols_array(matrix).as_dmat4()).filter(DAffine3::is_finite);
        let transform = transform.ok_or_else(|| Fault::malformed(place, "it is not finite, or not affine"))?;
        if transform.matrix3.determinant() == 0.0 {
            document.warnings.count("bind matrices without an inverse hide their vertices", place);
        }
        transforms.push(transform);
    }
    Ok(transforms)
}

/// The area of a figure, relative to the square of its longest side, from which on it counts as more than a line.
const LEAST_RELATIVE_AREA: f64 = 1e-9;

/// Gives each placement that flattens its mesh a flat mesh of its own, and removes the others, whose meshes have no area.
/// Moving instances keep to their placements. The limits are checked before the first mesh is copied.
fn settle(placements: &mut Placements, scene: &mut SourceScene, limits: &Limits) -> Result<(), Fault> {
    let Placements { moving, degenerate } = placements;
    let (flat, without_area): (Vec<usize>, Vec<usize>) =
        degenerate.iter().partition(|&&number| has_area(&scene.instances[number].source_from_mesh.matrix3));
    check_sizes(&flat, scene, limits)?;
    for number in flat {
        let instance = scene.instances[number];
        let flat = flattened(&scene.meshes[instance.mesh], &instance.source_from_mesh);
        scene.instances[number].mesh = scene.meshes.len();
        scene.instances[number].source_from_mesh = DAffine3::IDENTITY;
        scene.meshes.push(flat);
    }
    let mut is_removed = vec![false; scene.instances.len()];
    without_area.into_iter().for_each(|number| is_removed[number] = true);
    let kept = is_removed.iter().scan(0u32, |kept, is_removed| {
        let number = *kept;
        *kept += u32::from(!is_removed);
        Some(number)
    });
    let new_number: Vec<u32> = kept.collect();
    moving.iter_mut().for_each(|moving| moving.instance = new_number[moving.instance as usize]);
    let mut is_removed = is_removed.into_iter();
    scene.instances.retain(|_| !is_removed.next().unwrap_or(false));
    Ok(())
}

/// Counts what the flat meshes will have: a small file may place one large mesh many times.
fn check_sizes(flat: &[usize], scene: &SourceScene, limits: &Limits) -> Result<(), Fault> {
    let mut vertices: u64 = scene.meshes.iter().map(|mesh| mesh.vertices.len() as u64).sum();
    let mut triangles = 0u64;
    for &number in flat {
        let mesh = &scene.meshes[scene.instances[number].mesh];
        vertices = vertices.saturating_add(mesh.vertices.len() as u64);
        at_most("vertices of flattened meshes", vertices, limits.vertices)?;
        triangles = triangles.saturating_add(mesh.indices.len() as u64 / 3);
        at_most("triangles of flattened meshes", triangles, limits.triangles)?;
    }
    Ok(())
}

/// Whether a transform leaves some triangles an area.
fn has_area(linear: &DMat3) -> bool {
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
    let longest = x.length_squared().max(y.length_squared()).max(z.length_squared());
    let areas = [x.cross(y), y.cross(z), z.cross(x)].map(|cross| cross.length());
    longest > 0.0 && areas.into_iter().any(|area| area > LEAST_RELATIVE_AREA * longest)
}

/// The mesh where its placement puts it.
fn flattened(mesh: &SourceMesh, source_from_mesh: &DAffine3) -> SourceMesh {
    let mut flat = mesh.clone();
    flat.influences.clear();
    flat.positions_in_mesh.iter_mut().for_each(|position| *position = source_from_mesh.transform_point3(*position));
    let [x, y, z] = [0, 1, 2].map(|column| source_from_mesh.matrix3.col(column));
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    let largest = [0, 1, 2].map(|column| cofactors.col(column).length()).into_iter().fold(0.0, f64::max);
    // Faces that lose their area have no normal; they are not seen.
    let plane = [0, 1, 2].map(|column| cofactors.col(column)).into_iter().find(|normal| normal.length() >= largest);
    let fallback = plane.and_then(DVec3::try_normalize).unwrap_or(DVec3::Y);
    for vertex in &mut flat.vertices {
        let normal = cofactors * DVec3::from(vertex.normal.map(f64::from)) / largest;
        vertex.normal = normal.normalize_or(fallback).as_vec3().to_array();
    }
    for detail in &mut flat.details {
        let [tangent_x, tangent_y, tangent_z, sign] = detail.tangent;
        let tangent = DVec3::new(tangent_x.into(), tangent_y.into(), tangent_z.into());
        let tangent = (source_from_mesh.matrix3 * tangent).normalize_or(fallback.any_orthonormal_vector());
        detail.tangent = tangent.as_vec3().extend(sign).to_array();
    }
    flat
}
