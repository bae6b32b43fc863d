// Adds the light at the ends of mirrored rays to the pixels that show the mirrors, and lists the rays off mirrors among
// those ends.
{% include "reflection.wgsl" %}
{% include "view_work.wgsl" %}
{% include "cell.wgsl" %}
{% include "bounce/ray.wgsl" %}
{%- if single_pole %}
{% include "single_pole.wgsl" %}
{%- endif %}

// Of the pixels: linear, as RGB9E5.
@group(0) var<storage, read_write> out_color: array<u32>;
@group(0) var<storage, read_write> out_provenance: array<u32>;
// Of the images.
@group(0) var cell_colors: texture_2d<u32>;
// Of the rays.
@group(0) var<storage, read> rays: array<MirroredRay>;
@group(0) var<storage, read> ray_color: array<u32>;
@group(0) var<storage, read> inverse_depth: array<f32>;
@group(0) var<storage, read> provenance: array<u32>;
{% if reflects %}
{% include "gathered.wgsl" %}
{% endif %}
{% include "pixel_list.wgsl" %}
{% if mirrors %}
{% include "bounce/spawn.wgsl" %}
{% endif %}

{% include "colors.wgsl" %}
{% include "bounce/mips.wgsl" %}
// What a pixel shows of the surface at its ray's end.
fn landed(index: u32, ray: MirroredRay, origin: u32) -> vec3f {
    let throughput = linear_from_rgb9e5(ray.throughput_rgb9e5);
    let way_m = 1.0 / inverse_depth[index];
    let point_in_world = ray.origin_in_world + ray.direction * way_m;
    let width_m = ray.width_m + ray.spread * way_m;
{% if reflects %}
{% include "gather_at.wgsl" %}
{% else %}
{% include "nearest_at.wgsl" %}
{% endif %}
    let side_m = 1.0 / (inverse_w * camera.focal_px);
    let color = filtered(camera, linear_from_rgb9e5(ray_color[index]), uv + 0.5, abs(width_m) / side_m);
    var shown = color * throughput;
{% if reflects %}
    for (var glossy = around.reflecting > 0.0; glossy; glossy = false) {
        let throughput_linear = throughput * around.reflecting;
        shown += throughput_linear * highlight(point_in_world, around.normal, -ray.direction, around.reflector, around.visibility);
{% if mirrors %}
        let mirror = Mirror(point_in_world, around.normal, -ray.direction, unpack_reflector(around.reflector));
        let open = {{ "unpack4x8unorm(around.visibility[0]).x" if visibility_words > 0 else "1.0" }};
        let curvature = select(0.0, curvature_at(camera, cell_index, point_in_world, side_m), corners.connected);
        shown += bounce_off(mirror, ray.pixel, throughput_linear, open, side_m, cone_off(Cone(width_m, ray.spread), curvature));
{% endif %}
    }
{% endif %}
    return shown;
}

@compute @workgroup_size(LIST_WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= lists[work.view.number].count { return; }
    let index = listed_pixels[first_listed() + id.x];
    let ray = rays[index];
    let origin = provenance[index];
    let kind = origin & 0xffu;
    // The base has told what the mirror shows.
    if kind == PROVENANCE_BASE { return; }
    let guess = unpack4x8unorm(ray.guess);
    let is_unknown = kind == PROVENANCE_FILLED;
    // Where nothing is met the environment is seen; where no image knew, what the mirror shows without rays.
    var shown = environment_mirrored(ray.direction, max(guess.y, LEAST_ROUGHNESS)) * linear_from_rgb9e5(ray.throughput_rgb9e5) * select(1.0, guess.x, is_unknown);
    for (var hit = kind == PROVENANCE_HIT; hit; hit = false) { shown = landed(index, ray, origin); }
    out_color[ray.pixel] = rgb9e5_from_linear(linear_from_rgb9e5(out_color[ray.pixel]) + shown);
    for (var guessed = is_unknown; guessed; guessed = false) {
        out_provenance[ray.pixel] = (out_provenance[ray.pixel] & 0xffffff00u) | PROVENANCE_GUESSED;
    }
}
