{# Statements: the nearest `camera` of `origin`, and where it shows point_in_world. #}    // Cameras are sorted: of those that contributed, the last to be chosen is the nearest. On the software device one
    // camera by a variable index is cheaper than a choice among all.
    var nearest = 0u;
{% for k in range(cameras) | reverse %}
    nearest = select(nearest, {{ k }}u, (work.cameras[{{ k }}].mask & (origin >> 8u)) != 0u);
{% endfor %}
    let camera = work.cameras[nearest];
    let p = homogeneous(camera.homogeneous_pixel_from_world, vec4f(point_in_world, 1.0));
    let inverse_w = safe_reciprocal(p.z);
    let uv = clamp({{ "moved(poles.cameras[nearest], p.xy * inverse_w, inverse_w)" if single_pole else "p.xy * inverse_w" }} - 0.5, vec2f(0.0), camera.cells - CELL_MARGIN_PX);
