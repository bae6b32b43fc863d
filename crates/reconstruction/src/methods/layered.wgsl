// Rays through a layered depth cube: the nearest surface that its samples describe, and the light that it sends to the ray. Rays are
// those of a view, or those off the mirrors and into the lobes that a view shows. Where the cube is a base they are those of pixels and mirrored
// rays that images leave unknown, of mirrors that have no images, and of lobes.
{% include "color.wgsl" %}
{% include "normal.wgsl" %}
{%- if reflects or bounced %}
{% include "light.wgsl" %}
{% include "highlight.wgsl" %}
{%- endif %}
{% include "view_work.wgsl" %}
{%- if into_lobes %}
// Red, green and blue of each pixel.
@group(0) var<storage, read_write> lobe_light: array<f32>;
@group(0) var<storage, read_write> out_provenance: array<u32>;
{%- elif bounced %}
@group(0) var<storage, read_write> out_color: array<u32>;
@group(0) var<storage, read_write> out_provenance: array<u32>;
{%- else %}
{% include "found.wgsl" %}
{%- endif %}
{% include "cube_walk.wgsl" %}
{% include "cube/colors.wgsl" %}
{%- if reflects or bounced %}
@group(0) var<uniform> illumination: Illumination;
{%- endif %}
{%- if reflects %}
{% include "gathered.wgsl" %}
{%- endif %}
{%- if gathers %}
{% include "cube/gather.wgsl" %}
{%- endif %}
{%- if spawns or bounced %}
{% include "bounce/ray.wgsl" %}
{%- endif %}
{%- if spawns %}
{% include "bounce/spawn.wgsl" %}
{%- endif %}
{%- if lists_glossy %}
{% include "bounce/list_glossy.wgsl" %}
{%- endif %}
{%- if bounced %}
@group(0) var<storage, read> rays: array<MirroredRay>;
{%- if left %}
// Of the rays, as the images around their mirrors tell it.
@group(0) var<storage, read_write> ray_provenance: array<u32>;
{%- endif %}
{%- endif %}

// The light that a surface sends towards `towards_eye`, of which a pixel shows the share `throughput`. Mirrors list the rays off them.
fn light_from(hit: CubeHit, point_in_world: vec3f, towards_eye: vec3f, pixel: u32, throughput: vec3f) -> vec3f {
    let around = around_hit(hit);
    var shown = around.color_linear * throughput;
{%- if reflects %}
    let glossy = gathered(around.samples, around.shares);
    for (var reflects = glossy.reflecting > 0.0; reflects; reflects = false) {
        let own = throughput * glossy.reflecting;
        shown += own * highlight(point_in_world, glossy.normal, towards_eye, glossy.reflector, glossy.visibility);
{%- if mirrors %}
        let mirror = Mirror(point_in_world, glossy.normal, towards_eye, unpack_reflector(glossy.reflector));
{%- endif %}
{%- if gathers %}
        let share = {{ lobe_share }};
        for (var gathers = share > 0.0; gathers; gathers = false) {
            shown += own * environment_reflectance(mirror) * share * gathered_light(mirror);
        }
{%- endif %}
{%- if spawns or lists_glossy %}
        let open = {{ "unpack4x8unorm(glossy.visibility[0]).x" if visibility_words > 0 else "1.0" }};
{%- endif %}
{%- if lists_glossy %}
        let rest = {{ lobe_share }};
        for (var lists = rest > 0.0; lists; lists = false) { list_glossy(mirror, pixel, own * rest, open); }
{%- endif %}
{%- if spawns %}
        shown += bounce_off(mirror, pixel, own, open, cube.start_m / START_FOOTPRINTS, Cone(0.0, 0.0));
{%- endif %}
    }
{%- endif %}
    return shown;
}
{%- if bounced %}

@compute @workgroup_size(LIST_WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= lists[work.view.number].count { return; }
    let index = listed_pixels[first_listed() + id.x];
    let ray = rays[index];
    let throughput = linear_from_rgb9e5(ray.throughput_rgb9e5);
{%- if left %}
    if (ray_provenance[index] & 0xffu) != PROVENANCE_FILLED { return; }
{%- endif %}
    let hit = walk(cube_ray(ray.origin_in_world, ray.direction), {{ "max(ray.near_m, cube.start_m)" if left else "ray.near_m" }}, BEYOND_CUBE);
    let guess = unpack4x8unorm(ray.guess);
    let is_unknown = !hit.met{{ "" if truncated else " && !hit.is_empty" }};
    // Where nothing is met the environment is seen; where the cube does not know, what the mirror shows without rays.
    var shown = environment_mirrored(ray.direction, max(guess.y, LEAST_ROUGHNESS)) * throughput * select(1.0, guess.x, is_unknown);
    for (var met = hit.met; met; met = false) {
        shown = light_from(hit, ray.origin_in_world + ray.direction * hit.t, -ray.direction, ray.pixel, throughput);
    }
{%- if into_lobes %}
    for (var channel = 0u; channel < 3u; channel++) { lobe_light[3u * ray.pixel + channel] += shown[channel]; }
{%- else %}
    out_color[ray.pixel] = rgb9e5_from_linear(linear_from_rgb9e5(out_color[ray.pixel]) + shown);
{%- endif %}
    let origin = out_provenance[ray.pixel] & 0xffffff00u;
{%- if left %}
    ray_provenance[index] = PROVENANCE_BASE;
{%- endif %}
{%- if in_base %}
    // Of several rays one that is guessed counts.
    let is_guessed = is_unknown || (out_provenance[ray.pixel] & 0xffu) == PROVENANCE_GUESSED;
    out_provenance[ray.pixel] = origin | select(PROVENANCE_BASE, PROVENANCE_GUESSED, is_guessed);
{%- else %}
    for (var guessed = is_unknown; guessed; guessed = false) { out_provenance[ray.pixel] = origin | PROVENANCE_GUESSED; }
{%- endif %}
}
{%- else %}

@compute @workgroup_size({{ "LIST_WORKGROUP" if listed else "TILE_PX, TILE_PX" }})
fn main(@builtin(global_invocation_id) id: vec3u) {
{% include "at_pixel.wgsl" %}
    let pixel = pixel_of(place);
    let hit = walk(cube_ray(work.view.eye_in_world, pixel.direction), work.view.near_m, BEYOND_CUBE);
    var shown = vec3f(0.0);
    for (var met = hit.met; met; met = false) {
        let point_in_world = work.view.eye_in_world + pixel.direction * hit.t;
        shown = light_from(hit, point_in_world, -normalize(pixel.direction), pixel.index, vec3f(1.0));
    }
    write_found(pixel.index, hit.met, hit.t, shown, origin_of({{ "0u" if left else "1u << hit.axis" }}, 0u), {{ "false" if truncated else "hit.is_empty" }});
{%- if left %}
    for (var met = hit.met; met; met = false) { out_provenance[pixel.index] = PROVENANCE_BASE; }
{%- endif %}
}
{%- endif %}
