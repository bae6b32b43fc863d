// A ray off a mirror, or of an eye that looks through glass; and once it was followed the point where it ends.
struct Bounce {
    // Where the ray begins; once it was followed, where it ends.
    point_in_world: vec3f,
    // The pixel's place among those of all pictures.
    place: u32,
    // A unit vector.
    direction: vec3f,
    // Of noise: the pixel's in its picture, hashed once for each mirror.
    seed: u32,
    // Of the light from the ray's end.
    throughput_linear: vec3f,
    // The side of the pixel's footprint across the ray, at `point_in_world`.
    side_m: f32,
    // Words of packed_surface.wgsl, of the ray's end.
    surface: vec4u,
    // Rays from the end begin this far above it.
    bias_m: f32,
    // The growth of the side in a metre.
    spread: f32,
    // Of the mirror from which the ray comes.
    roughness: f32,
    // Mean curvature at the end, positive where convex.
    curvature_per_m: f32,
    // 1 where the ray ends at a surface, or else 0.
    met: u32,
    // What is nearer to a mirror than the pixel's footprint on the first is the mirror itself.
    near_m: f32,
    // 1 for an eye's ray that has met no mirror, or else 0.
    unmirrored: u32,
}

struct BounceList { workgroups: u32, y: u32, z: u32, count: u32 }
