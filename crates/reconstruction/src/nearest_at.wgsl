{# Statements: the nearest `camera` of `origin`, or the finest of mirrored rays, and where it shows point_in_world. #}
{%- if finest is defined %}    // The camera whose texels are smallest there: its colour counts most.
    var nearest = 0u;
    var texels_per_m = 0.0;
{% for k in range(cameras) %}
    {
        let depth_m = dot(work.cameras[{{ k }}].homogeneous_pixel_from_world[2], vec4f(point_in_world, 1.0));
        let has_part = (work.cameras[{{ k }}].mask & (origin >> 8u)) != 0u && depth_m > 0.0;
        let density = select(0.0, work.cameras[{{ k }}].focal_px / depth_m, has_part);
        nearest = select(nearest, {{ k }}u, density > texels_per_m);
        texels_per_m = max(texels_per_m, density);
    }
{% endfor %}
{% else %}    // Cameras are sorted: of those that contributed, the last to be chosen is the nearest. On the software device one
    // camera by a variable index is cheaper than a choice among all.
    var nearest = 0u;
{% for k in range(cameras) | reverse %}
    nearest = select(nearest, {{ k }}u, (work.cameras[{{ k }}].mask & (origin >> 8u)) != 0u);
{% endfor %}
{% endif %}
    let camera = work.cameras[nearest];
    let p = homogeneous(camera.homogeneous_pixel_from_world, vec4f(point_in_world, 1.0));
    let inverse_w = safe_reciprocal(p.z);
    let uv = clamp(p.xy * inverse_w - 0.5, vec2f(0.0), camera.cells - CELL_MARGIN_PX);
