// Tolerance redundancy: one of the four samples around the place in the image before lies on the same surface, faces
// the same way, and is not much coarser. A sample of the temporal reference stays until all four do, by a margin.

fn is_redundant_with(candidate: Candidate, number: u32, camera: KnownCamera) -> bool {
    let p = homogeneous_in(camera, candidate);
    let along = abs(dot(candidate.normal, candidate.point_in_world - camera.eye_in_world)) / p.z;
    // The change of planar depth from one pixel to the next on the candidate's own plane.
    let across = abs(dot(candidate.normal, camera.column_in_world)) + abs(dot(candidate.normal, camera.row_in_world));
    let slope = p.z * across / max(along, 1e-6);
    let allowed = select(1.0, CLEARLY, candidate.was_kept);
    let least_facing = select(SAME_FACING, CLEARLY_SAME_FACING, candidate.was_kept);
    let room = allowed * max(DEPTH_FOOTPRINTS * p.z * camera.footprint, SLOPE_PX * slope);
    var some = false;
    var all_four = true;
{% for corner in range(4) %}
    {
        let corner = vec2f({{ corner % 2 }}.0, {{ corner // 2 }}.0) - 0.5;
        // Loads cost less than a branch around them.
        let held = textureLoad(known_samples, nearest_texel(camera, p + vec3f(corner * p.z, 0.0)), number, 0);
        let depth_m = 1.0 / max(bitcast<f32>(held.x), 1e-30);
        let normal = vec3f(unpack2x16snorm(held.z), bitcast<f32>(held.w));
        let near = held.x != 0u && abs(depth_m - p.z) < room;
        let facing = dot(normal, candidate.normal) > least_facing;
        let fine = bitcast<f32>(held.y) <= allowed * COARSER * candidate.footprint_m;
        some = some || (near && facing && fine);
        all_four = all_four && near && facing && fine;
    }
{% endfor %}
    return select(some, all_four, candidate.was_kept) && is_in_view(camera, p);
}
