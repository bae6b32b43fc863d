{# Statements: the samples `around` point_in_world in the nearest camera of `origin`, and that `camera`. #}
{% include "nearest_at.wgsl" %}
    let cell = vec2u(uv);
    let at = uv - floor(uv);
    let cell_index = camera.first_cell + cell.y * camera.width_px + cell.x;
    let corners = corners_of(cell_index);
    // As in surface.wgsl: in a connected cell the surface itself counts, else each sample for itself.
    let code_above = camera.code_scale * inverse_w;
    let gaps = code_above + camera.code_offset - select(corners.codes, vec4f(bilinear(corners.codes, at)), corners.connected);
    let reach = vec4f(THICKNESS_FOOTPRINTS * code_above / camera.focal_px);
    let shares = select(vec4f(0.0), bilinear_shares(at), (abs(gaps) < reach) & (corners.codes > vec4f(1.5)));
    let around = gathered(cell_index + vec4u(0u, 1u, camera.width_px, camera.width_px + 1u), shares);
