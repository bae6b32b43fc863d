// The length of a pixel on the surface that it shows.

// A pixel's length on a surface at this depth that is met at this angle.
fn stretched_footprint(planar_depth_m: f32, footprint: f32, normal: vec3f, sight: vec3f) -> f32 {
    let facing = abs(dot(normal, sight)) * inverseSqrt(max(dot(sight, sight), 1e-30));
    return planar_depth_m * footprint / max(facing, LEAST_FACING);
}
