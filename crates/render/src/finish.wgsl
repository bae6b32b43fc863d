// Surface and light to finished planes: a view's colour and depth, or those of a depth image.
{% include "camera.wgsl" %}
{% include "color.wgsl" %}
{% include "tone.wgsl" %}
{% include "background.wgsl" %}
{% include "normal.wgsl" %}
{% include "albedo.wgsl" %}
{% include "surfaces.wgsl" %}
{% if environment_map %}
{% include "table.wgsl" %}
{% endif %}
{% if highlight %}
{% include "light.wgsl" %}
{% include "highlight.wgsl" %}
{% elif environment_map %}
{% include "environment.wgsl" %}
{% endif %}

// The finished planes of each camera, one after the other.
@group(0) var<storage, read_write> words: array<u32>;
@group(0) var<storage, read> sums: array<f32>;
@group(0) var<uniform> finish: Finish;
{% if averaged %}
// Red, green and blue of each pixel: linear light, over the positions so far; of a texel, with the number that counts.
@group(0) var<storage, read_write> position_sums: array<f32>;
{% endif %}
{% if highlight %}
@group(0) var<uniform> illumination: Illumination;
{% endif %}
{%- if reflected %}
// Red, green and blue of each pixel: linear light that followed rays bring.
@group(0) var<storage, read> reflected: array<f32>;
{%- endif %}
{% if surface_id %}
@group(0) var surface_ids: texture_2d<u32>;
{% endif %}
{% if redundancy %}
// The reversed depth of the nearest surface on each pixel's ray, redundant or not.
@group(0) var front_depth: {{ "texture_2d<f32>" if by_rays else "texture_depth_2d" }};
{% endif %}
{% if covered %}
// 1 for pixels that keep their samples.
@group(0) var<storage, read> kept: array<u32>;
{% endif %}
{% include "sums.wgsl" %}
{% include "lamp_shares.wgsl" %}

// The position within the pixels, of so many. One beyond them is the centre: it gives depth, and no colour.
struct Finish { tone: Tone, position: u32, position_count: u32, shares: LampShares }
{% if redundancy %}

fn front_at(texel: vec2u) -> f32 { return textureLoad(front_depth, texel, 0){{ ".x" if by_rays else "" }}; }
{% endif %}

fn put(plane: u32, place: u32, word: u32) { words[camera.first_word + plane * camera.pixel_count + place] = word; }
{%- if redundancy %}

// A hole lies behind redundant surfaces where nothing else is met: nothing is known of it.
fn put_depth_behind(place: u32, depth: f32, front: f32, met: bool) {
    put(1u, place, bitcast<u32>(select(depth / camera.near_m, -1.0, !met && front > 0.0)));
    put({{ passed_plane }}u, place, select(0u, 1u, front > depth));
}
{%- endif %}
{% if visibility %}

{% include "visibility.wgsl" %}
{% endif %}

{% if light %}

@group(0) var triangle_normals: texture_2d<u32>;

// Bytes of shares: the environment's, then those of lamps that have one, then that of all other lamps.
fn share_word(word: u32, place: u32) -> u32 {
    var shares = vec4f(0.0);
    for (var i = 0u; i < 4u; i++) {
        let number = word * 4u + i;
        if number > finish.shares.lamp_count { break; }
        shares[i] = share_of(number, place);
    }
    return pack4x8unorm(shares);
}

fn share_of(number: u32, place: u32) -> f32 {
    if number == 0u { return sum_at(OPEN_TO_ENVIRONMENT, place) / f32(camera.ambient_rays_in_sum); }
    let rays = f32(camera.shadow_rays_in_sum);
    if number <= MAX_LAMP_SHARES { return sum_at(OPEN_TO_LAMPS + lamp_of(number - 1u), place) / rays; }
    var open = 0.0;
    for (var lamp = 0u; lamp < {{ light_count }}u; lamp++) { open += sum_at(OPEN_TO_LAMPS + lamp, place); }
    for (var named = 0u; named < MAX_LAMP_SHARES; named++) { open -= sum_at(OPEN_TO_LAMPS + lamp_of(named), place); }
    return open / (rays * {{ light_count }}.0 - rays * f32(MAX_LAMP_SHARES));
}

fn lamp_of(number: u32) -> u32 { return finish.shares.lamps[number / 4u][number % 4u]; }

fn put_light(pixel: vec2u, place: u32, met: bool) {
    put(0u, place, rgb9e5_from_linear({{ "select(vec3f(0.0), lamps_at(place), met)" if lit else "vec3f(0.0)" }}));
    put({{ light_plane }}u, place, textureLoad(triangle_normals, pixel, 0).x);
    put({{ light_plane + 1 }}u, place, rgb9e5_from_linear({{ "select(vec3f(0.0), environment_at(place, 1.0), met)" if lit else "vec3f(0.0)" }}));
{%- for word in range(share_words) %}
    put({{ light_plane + 2 + word }}u, place, share_word({{ word }}u, place));
{%- endfor %}
}
{% endif %}
{% if averaged and samples %}

// Adds the colour of one position, if it shows the surface of the centre, the first position; gives the mean so far.
fn mean_with(color: vec3f, inverse_depth_per_m: f32, place: u32) -> vec3f {
    let first = 4u * (camera.first_word / {{ plane_count }}u + place);
    var sum = vec4f(color, 1.0);
    if finish.position > 0u {
        let center_per_m = bitcast<f32>(words[camera.first_word + camera.pixel_count + place]);
        let is_same = abs(inverse_depth_per_m - center_per_m) <= SAME_SURFACE * center_per_m;
        sum = select(vec4f(0.0), sum, is_same);
        for (var i = 0u; i < 4u; i++) { sum[i] += position_sums[first + i]; }
    }
    for (var i = 0u; i < 4u; i++) { position_sums[first + i] = sum[i]; }
    return sum.rgb / sum.a;
}
{% elif averaged %}

// Adds the colour of one position, and gives the mean of all so far.
fn mean_with(color: vec3f, place: u32) -> vec3f {
    let first = 3u * (camera.first_word / {{ plane_count }}u + place);
    var sum = select(color, vec3f(0.0), finish.position == finish.position_count);
    if finish.position > 0u { sum += vec3f(position_sums[first], position_sums[first + 1u], position_sums[first + 2u]); }
    position_sums[first] = sum.r;
    position_sums[first + 1u] = sum.g;
    position_sums[first + 2u] = sum.b;
    return sum / f32(min(finish.position + 1u, finish.position_count));
}
{% endif %}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = pixel_at(id);
    if is_beyond(pixel) { return; }
    let place = place_of(pixel);
    let depth = reversed_depth_at(pixel);
    let surface = surface_at(pixel);
    var met = depth > 0.0;
{% if covered %}
    let is_hole = met && kept[camera.first_word / {{ plane_count }}u + place] == 0u;
    met = met && !is_hole;
{% endif %}
{% if redundancy %}
    let front = front_at(pixel);
{% endif %}
{% if light %}    put_light(pixel, place, met);
{% else %}{% include "shaded.wgsl" %}
{% endif %}
{% if highlight %}
    for (var glossy = met && surface.w != 0u; glossy; glossy = false) {
        let direction = direction_of(pixel);
        let point = {{ "origin_of(pixel)" if single_pole else "camera.eye_in_world" }} + direction * (camera.near_m / depth);
        // Where rays go into lobes, they bring the environment.
        var visibility: VisibilityWords;
{% for word in range(visibility_words) %}        visibility[{{ word }}] = visibility_word({{ word }}u, place, {{ "0.0" if glossy else "open" }});
{% endfor %}
        linear += highlight(point, unit_from_oct16(surface.z), -normalize(direction), surface.w, visibility);
    }
{% endif %}
{%- if reflected %}
    // Glass of no reflectance has no highlight.
    for (var followed = met; followed; followed = false) {
        let first = 3u * (camera.first_word / {{ plane_count }}u + place);
        linear += vec3f(reflected[first], reflected[first + 1u], reflected[first + 2u]);
    }
{% endif %}
{% if not light %}    for (var open = !met; open; open = false) { linear = background_linear(direction_of(pixel)); }
{% endif %}{% if light %}{% elif samples and averaged %}
    put(0u, place, rgb9e5_from_linear(mean_with(linear, depth / camera.near_m, place)));
    // All other planes are the centre's.
    if finish.position > 0u { return; }
{% elif samples %}
    put(0u, place, rgb9e5_from_linear(linear));
{% else %}
    let shown = shown_from_mean({{ "mean_with(linear, place)" if averaged else "linear" }}, finish.tone);
    put(0u, place, pack4x8unorm(vec4f(srgb_from_linear(shown), 1.0)));
{% endif %}
{% if redundancy %}
    put_depth_behind(place, depth, front, met);
{% elif covered %}
    put(1u, place, bitcast<u32>(select(depth / camera.near_m, -1.0, is_hole)));
{% else %}
    put(1u, place, bitcast<u32>(depth / camera.near_m));
{% endif %}
{% if normal_plane %}    put({{ normal_plane }}u, place, surface.z);
{% endif %}
{% if reflector_plane %}    put({{ reflector_plane }}u, place, select(0u, surface.w, met));
{% for word in range(visibility_words) %}    put({{ reflector_plane + 1 + word }}u, place, visibility_word({{ word }}u, place, open));
{% endfor %}
{% endif %}
{% if surface_id %}
    let ids = select(vec2u(0u), textureLoad(surface_ids, pixel, 0).xy, met);
    put({{ id_plane }}u, place, ids.x);
    put({{ id_plane + 1 }}u, place, ids.y);
{% endif %}
}
