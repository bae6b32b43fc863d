//! Prints the contents and loading times of scenes:
//! `cargo run --release -p scene --example inspect -- tree-terrain-500k model.glb`.

use std::time::Instant;

use scene::{EnvironmentSpec, LightSpec, Limits, MissingTextures, SceneSpec, SourceSpace, pack, unpack};

fn main() {
    tracing_subscriber::fmt().with_writer(std::io::stderr).without_time().init();
    for name in std::env::args().skip(1) {
        match name.parse::<SceneSpec>() {
            Ok(spec) => inspect(&spec),
            Err(error) => println!("{name}: {error}"),
        }
    }
}

fn inspect(spec: &SceneSpec) {
    let limits = Limits::default();
    let start = Instant::now();
    let scene = match spec.load(&limits, MissingTextures::Grey) {
        Ok(scene) => scene,
        Err(error) => return println!("{spec}: refused after {:?}: {error}", start.elapsed()),
    };
    let load = start.elapsed();
    let vertices: usize = scene.meshes.iter().map(|m| m.vertices.len()).sum();
    println!("{spec}: {} triangles, {vertices} vertices, loaded in {load:.1?}", scene.triangle_count());
    let (meshes, instances, parts) =
        (scene.meshes.len(), scene.instances.len(), scene.meshes.iter().map(|m| m.parts.len()).sum::<usize>());
    println!("  {meshes} meshes in {parts} parts, {instances} instances, {} materials", scene.materials.len());
    let sizes: Vec<_> = scene.textures.iter().map(|t| format!("{}x{}", t.width_px, t.height_px)).collect();
    let (lights, environment) = (&scene.illumination.lights, scene.illumination.environment);
    println!("  textures {sizes:?}, {} specular materials", scene.materials.iter().filter(|m| m.is_specular()).count());
    println!(
        "  {} lights, environment {}, {} cameras",
        lights.len(),
        EnvironmentSpec::Colors(environment),
        scene.cameras.len()
    );
    lights.iter().for_each(|&light| println!("  {}", LightSpec(light)));
    let bounds = scene.bounds();
    let SourceSpace { origin_in_source, metres_per_unit } = scene.source_space;
    println!("  bounds {} to {}, origin in source {origin_in_source}", bounds.min, bounds.max);
    println!("  metres per unit of source {metres_per_unit}");
    let start = Instant::now();
    let package = pack(&scene);
    let packed = start.elapsed();
    let start = Instant::now();
    let is_same = unpack(&package, &limits).is_ok_and(|unpacked| unpacked == scene);
    println!("  {} bytes packed in {packed:.1?}, unpacked in {:.1?}, same: {is_same}", package.len(), start.elapsed());
    println!("  {}", blake3::hash(&package).to_hex());
}
