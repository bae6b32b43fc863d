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
    // The open share of the environment.
    open: f32,
    // 1 where all rays go below the surface: the mirrored one takes their place.
    is_mirrored: u32,
    padding: vec2u,
}
