// A ray off a mirror, which is followed in the images of the mirror's surroundings.
struct MirroredRay {
    // On the mirror.
    origin_in_world: vec3f,
    // The pixel that shows the mirror.
    pixel: u32,
    // A unit vector.
    direction: vec3f,
    // Of the mirror: the open share of the environment and the roughness, in bytes.
    guess: u32,
    // The share of the light from the ray's end that the pixel shows.
    throughput_linear: vec3f,
    // Nothing nearer is met.
    near_m: f32,
}
