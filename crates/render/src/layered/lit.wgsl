// The colours of listed surfaces, without highlights, and the shares of lamps that they see.
{% include "camera.wgsl" %}
{% include "color.wgsl" %}
{% include "albedo.wgsl" %}
{% include "reflections/ends.wgsl" %}

// Plane by plane: colour, and words of visibility.
@group(0) var<storage, read_write> words: array<u32>;

@compute @workgroup_size(LIST_WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let place = id.x;
    if place >= list.count { return; }
    let surface = bounces[place].surface;
    let met = true;
{% include "shaded.wgsl" %}
    words[place] = rgb9e5_from_linear(linear);
{% for word in range(visibility_words) %}    words[{{ word + 1 }}u * camera.pixel_count + place] = visibility_word({{ word }}u, place, open);
{% endfor %}
}
