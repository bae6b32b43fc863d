{# Statements: the diffuse light of `surface` at `place`, if one is `met`, as `linear`, and the `open` share. #}    let occluded = met && (surface.x & OCCLUDED) != 0u;
    let open = select(1.0, bitcast<f32>(surface.y), occluded);
    var light = vec3f(1.0);
{% if lit %}
    light = select(light_at(place, open), light, (surface.x & SHOWN_AS_IT_IS) != 0u);
{% endif %}
    var linear = albedo_linear(surface.x) * light + select(linear_from_rgb9e5(surface.y), vec3f(0.0), occluded);
