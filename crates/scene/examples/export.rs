//! Prints the triangles of a scene that do not emit light, its sun and its sky, as JSON: `scripts/compare_mitsuba.py` reads it.

use depth_image::{Light, linear_from_srgb8};
use glam::Vec3;
use scene::{Limits, MissingTextures, SceneSpec};
use serde_json::json;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let name = std::env::args().nth(1).ok_or("usage: export SCENE")?;
    let scene = name.parse::<SceneSpec>()?.load(&Limits::default(), MissingTextures::Refuse)?;
    let glows = |material: u32| scene.materials[material as usize].emissive_linear != Vec3::ZERO;
    let mut places = Vec::new();
    let mut normals = Vec::new();
    let mut colors = Vec::new();
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh as usize];
        for part in mesh.parts.iter().filter(|part| !glows(part.material)) {
            for index in &mesh.indices[part.first_index as usize..][..part.index_count as usize] {
                let vertex = &mesh.vertices[*index as usize];
                places.extend(instance.world_from_mesh.transform_point3(vertex.position.into()).to_array());
                normals.extend(
                    instance.world_from_mesh.transform_vector3(vertex.normal.into()).normalize_or(Vec3::Y).to_array(),
                );
                colors.extend([0, 1, 2].map(|channel| linear_from_srgb8(vertex.color_srgba8[channel])));
            }
        }
    }
    let sun = scene.illumination.lights.iter().find_map(|light| match light {
        Light::Directional { towards_light_in_world, irradiance_linear, .. } => {
            Some([towards_light_in_world.to_array(), irradiance_linear.to_array()])
        }
        _ => None,
    });
    let sky = scene.illumination.environment;
    let sky = json!([sky.zenith_linear.to_array(), sky.nadir_linear.to_array()]);
    println!("{}", json!({ "places": places, "normals": normals, "colors": colors, "sun": sun, "sky": sky }));
    Ok(())
}
