{# Statements: the samples `around` point_in_world in the nearest camera of `origin`, and that `camera`. #}    // Cameras are sorted: of those that contributed, the last to be chosen is the nearest. On the software device one
    // camera by a variable index is cheaper than a choice among all.
    var nearest = 0u;
{% for k in range(cameras) | reverse %}
    nearest = select(nearest, {{ k }}u, (work.cameras[{{ k }}].mask & (origin >> 8u)) != 0u);
{% endfor %}
    let camera = work.cameras[nearest];
    let p = homogeneous(camera.homogeneous_pixel_from_world, vec4f(point_in_world, 1.0));
    let inverse_w = safe_reciprocal(p.z);
    let uv = clamp(p.xy * inverse_w - 0.5, vec2f(0.0), camera.cells - CELL_MARGIN_PX);
    let cell = vec2u(uv);
    let at = uv - floor(uv);
    let cell_index = camera.first_cell + cell.y * camera.width_px + cell.x;
    let corners = corners_of(cell_index);
    // As in surface.wgsl: in a connected cell the surface itself counts, else each sample for itself.
    let code_above = camera.code_scale * inverse_w;
    let gaps = code_above + camera.code_offset - select(corners.codes, vec4f(bilinear(corners.codes, at)), corners.connected);
    let reach = vec4f(THICKNESS_FOOTPRINTS * code_above / camera.focal_px);
    let shares = select(vec4f(0.0), bilinear_shares(at), (abs(gaps) < reach) & (corners.codes > vec4f(1.5)));
    let around = gathered(cell_index, camera.width_px, shares);
