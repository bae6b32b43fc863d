//! Tangents along the coordinates of a normal map, as MikkTSpace has them (Mikkelsen 2008), with which normal maps are
//! baked. `meshoptimizer-rs` computes them.

use std::collections::HashMap;

use meshoptimizer_rs::{Error, Positions, TANGENT_COMPATIBLE, Workspace, generate_tangents};

use super::source_scene::SourceMesh;

/// Sets the tangents of all corners. Corners of one vertex whose tangents differ get separate vertices. The mesh has
/// normals and details; `second_uv` says on which pair of coordinates the normal map lies.
pub(crate) fn generate(mesh: &mut SourceMesh, second_uv: bool) -> Result<(), Error> {
    let positions: Vec<[f32; 3]> = mesh.positions_in_mesh.iter().map(|p| p.as_vec3().to_array()).collect();
    let normals: Vec<[f32; 3]> = mesh.vertices.iter().map(|v| v.normal).collect();
    let uvs: Vec<[f32; 2]> = match second_uv {
        false => mesh.vertices.iter().map(|v| v.uv).collect(),
        true => mesh.details.iter().map(|d| d.uv).collect(),
    };
    let positions = Positions::from_packed(&positions);
    let indices = Some(&*mesh.indices);
    let workspace = &mut Workspace::default();
    let count = mesh.indices.len();
    let tangents = generate_tangents(indices, count, positions, &normals, &uvs, TANGENT_COMPATIBLE, workspace)?;
    let mut number_of = HashMap::new();
    let mut is_set = vec![false; mesh.vertices.len()];
    for (corner, [x, y, z, sign]) in tangents.into_iter().enumerate() {
        // MikkTSpace's bitangent points along v; that of glTF, whose v points down, against it.
        let tangent = [x, y, z, -sign];
        let vertex = mesh.indices[corner];
        let key = (vertex, tangent.map(f32::to_bits));
        let number = *number_of.entry(key).or_insert_with(|| {
            if std::mem::replace(&mut is_set[vertex as usize], true) { mesh.copy_of(vertex) } else { vertex }
        });
        mesh.details[number as usize].tangent = tangent;
        mesh.indices[corner] = number;
    }
    Ok(())
}
