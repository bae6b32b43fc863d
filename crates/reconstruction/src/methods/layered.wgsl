// View rays through a layered depth cube: the nearest surface that its samples describe.
{% include "color.wgsl" %}
{% include "normal.wgsl" %}
{% include "view_work.wgsl" %}
{% include "found.wgsl" %}
{% include "cube/walk.wgsl" %}
{% include "cube/colors.wgsl" %}
{% if listed %}
{% include "pixel_list.wgsl" %}
{% endif %}

@compute @workgroup_size({{ "LIST_WORKGROUP" if listed else "TILE_PX, TILE_PX" }})
fn main(@builtin(global_invocation_id) id: vec3u) {
{% if listed %}
    if id.x >= lists[work.view.number].count { return; }
    let pixel = pixel_of(place_of(listed_pixels[first_listed() + id.x]));
{% else %}
    let at = pixel_at(id);
    if any(at >= work.view.size_px) { return; }
    let pixel = pixel_of(at);
{% endif %}
    let hit = walk(cube_ray(work.view.eye_in_world, pixel.direction), work.view.near_m);
    var color = vec3f(0.0);
    for (var met = hit.met; met; met = false) { color = color_at(hit); }
    write_found(pixel.index, hit.met, hit.t, color, origin_of(1u << hit.axis, 0u), {{ "false" if truncated else "true" }});
}
