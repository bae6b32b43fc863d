{# The surface of a pixel, from which rays of light begin. -#}
fn spot_of(pixel: vec2u, depth: f32, surface: vec4u) -> Spot {
    let planar_depth_m = camera.near_m / depth;
    let offset = direction_of(pixel) * planar_depth_m;
    let point = {{ "origin_of(pixel)" if single_pole else "camera.eye_in_world" }} + offset;
    let normal = unit_from_oct16(surface.z);
    let size = abs(camera.eye_in_world) + abs(offset);
    let bias_m = BIAS_FOOTPRINTS * planar_depth_m * camera.footprint + BIAS_ROUNDINGS * max(max(size.x, size.y), size.z);
    let from_axis = pixel + camera.first_from_axis;
    let seed = hashed(camera.seed ^ hashed((from_axis.x & 0xffffu) | (from_axis.y << 16u)));
    return Spot(point, normal, point + normal * bias_m, bias_m, seed);
}
