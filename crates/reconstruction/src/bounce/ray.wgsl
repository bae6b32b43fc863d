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
    // The share of the light from the ray's end that the pixel shows: linear, as RGB9E5.
    throughput_rgb9e5: u32,
    // Nothing nearer is met.
    near_m: f32,
    // The side of the pixel's footprint on the mirror, and what it grows by in a metre along the ray. Both may be negative, beyond
    // a focus.
    width_m: f32,
    spread: f32,
}
