{% set bounced = true -%}
// The march of mirrored rays, from image to image around the mirror; what it leaves goes to joint_carve.wgsl.
{% include "surface.wgsl" %}
{% include "pixel_list.wgsl" %}
{% include "bounce/ray.wgsl" %}
@group(0) var<storage, read> rays: array<MirroredRay>;

{% include "joint_carve/march_image.wgsl" %}

fn sees(camera: SampleCamera, p: vec3f) -> bool {
    let uv = p.xy / p.z - 0.5;
    return p.z > 0.0 && all(uv >= vec2f(0.0)) && all(uv < camera.cells);
}

@compute @workgroup_size(LIST_WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= lists[work.view.number].count { return; }
    let index = listed_pixels[first_listed() + id.x];
    let ray = rays[index];
    let span = span_in_volume(ray.origin_in_world, ray.direction, ray.near_m);
{% for k in range(cameras) %}
    let camera{{ k }} = work.cameras[{{ k }}];
    let a{{ k }} = homogeneous(camera{{ k }}.homogeneous_pixel_from_world, vec4f(ray.origin_in_world, 1.0));
    let b{{ k }} = homogeneous(camera{{ k }}.homogeneous_pixel_from_world, vec4f(ray.direction, 0.0));
{% endfor %}
    var found = March(span.near, false);
    for (var round = 0u; round < MARCH_ROUNDS; round++) {
{% for k in range(cameras) %}
        // Few of the images see a point. A loop that no ray enters costs nothing, unlike a branch.
        for (var marches = !found.crossed && found.t < span.far && sees(camera{{ k }}, a{{ k }} + b{{ k }} * found.t); marches; marches = false) {
            found = march(a{{ k }}, b{{ k }}, found.t, span.far, camera{{ k }});
        }
{% endfor %}
    }
    let blend = blend_two_best(ray.origin_in_world + ray.direction * found.t, ray.direction);
    let hit = found.crossed && blend.occupied;
    let empty = !found.crossed && span.far - found.t <= LEAST_WAY * abs(span.far);
    let color = select(0u, rgb9e5_from_linear(blend.color_linear), hit);
    let provenance = select(PROVENANCE_HIT | blend.origin, PROVENANCE_EMPTY, empty);
    // A ray that is left undecided keeps how far it got where its inverse depth will be.
    write_pixel(index, color, select(select(found.t, 1.0 / found.t, hit), 0.0, empty), provenance);
    if !hit && !empty { leave_undecided(index); }
}
