//! Placements without an inverse: those that flatten a mesh, and those that leave no area of it.

use glam::{DAffine3, DMat3, DVec3};

use super::super::source_scene::{SourceMesh, SourceScene};
use super::animation::Placements;
use crate::Limits;
use crate::error::{Fault, at_most};

/// The area of a figure, relative to the square of its longest side, from which on it counts as more than a line.
const LEAST_RELATIVE_AREA: f64 = 1e-9;

/// Gives each placement that flattens its mesh a flat mesh of its own, and removes the others, whose meshes have no area.
/// Moving instances keep to their placements. The limits are checked before the first mesh is copied.
pub(super) fn settle(placements: &mut Placements, scene: &mut SourceScene, limits: &Limits) -> Result<(), Fault> {
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
