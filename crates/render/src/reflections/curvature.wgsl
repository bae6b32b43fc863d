// The mean curvature of a triangle's front per metre, positive where convex: how much the normal turns along the edges.
fn curvature_of(crossing: Crossing, slot: u32) -> f32 {
    var corners = array<vec3f, 3>();
    var normals = array<vec3f, 3>();
    for (var i = 0u; i < 3u; i++) {
        corners[i] = bitcast<vec3f>(corner_texel(slot * 3u + i).xyz);
        normals[i] = unit_from_oct16(vertex_texel(crossing.corners[i]).x);
    }
    var sum = 0.0;
    for (var i = 0u; i < 3u; i++) {
        let edge = corners[(i + 1u) % 3u] - corners[i];
        sum += dot(normals[(i + 1u) % 3u] - normals[i], edge) / max(dot(edge, edge), 1e-20);
    }
    return sum / 3.0;
}
