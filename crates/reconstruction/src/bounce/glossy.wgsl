// Rough surfaces that pixels show, from which rays go into their lobes.

struct GlossySurface {
    point_in_world: vec3f,
    // The pixel that shows it.
    pixel: u32,
    // A unit vector.
    towards_eye: vec3f,
    normal_oct16: u32,
    // The share that the pixel shows of the light of a ray with weight 1.
    throughput_linear: vec3f,
    roughness: f32,
    // A ray straight up meets nothing nearer.
    start_m: f32,
    // The open share of the environment.
    open: f32,
    padding: vec2u,
}

// Rays of a pixel; the number of one of them.
struct LobeRays { count: u32, number: u32 }

@group(0) var<uniform> lobe_rays: LobeRays;

// Of noise: that of a place does not depend on the picture around it.
fn seed_of(point_in_world: vec3f) -> u32 {
    let bits = bitcast<vec3u>(point_in_world);
    return hashed(bits.x ^ hashed(bits.y ^ hashed(bits.z)));
}
