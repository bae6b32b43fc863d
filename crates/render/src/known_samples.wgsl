// The samples that images before this one hold, and the test that says which candidates of this image are redundant. The
// test is another template: `is_redundant_with(candidate, number, camera)`, of one candidate and one of those cameras.

struct KnownCamera {
    // Rows that take (column · w, row · w, w, 1) of the image that asks to (column · w, row · w, w) of this one; w is
    // the planar depth in metres.
    homogeneous_pixel_from_own: array<vec4f, 3>,
    eye_in_world: vec3f,
    near_m: f32,
    columns: f32,
    rows: f32,
}

// A sample that the image would show.
struct Candidate {
    // Column · w, row · w, w, 1.
    homogeneous_pixel: vec4f,
    point_in_world: vec3f,
    reversed_depth: f32,
    // A pixel's length on the surface, in metres.
    footprint_m: f32,
    id: vec2u,
    pixel: vec2u,
}

// A layer for each camera, with texels as the test wants them.
@group({{ known_group }}) var known_samples: texture_2d_array<u32>;
@group({{ known_group }}) var<uniform> known_cameras: array<KnownCamera, {{ [earlier, 1] | max }}>;

{% include "footprint.wgsl" %}

fn homogeneous_in(camera: KnownCamera, candidate: Candidate) -> vec3f {
    let rows = camera.homogeneous_pixel_from_own;
    let p = candidate.homogeneous_pixel;
    return vec3f(dot(rows[0], p), dot(rows[1], p), dot(rows[2], p));
}

// Outside of the image nothing is known.
fn is_in_view(camera: KnownCamera, homogeneous: vec3f) -> bool {
    let size = vec2f(camera.columns, camera.rows) * homogeneous.z;
    return homogeneous.z > camera.near_m && all(homogeneous.xy >= vec2f(0.0)) && all(homogeneous.xy < size);
}

// The texel of the projection, or the nearest one at the image's rim.
fn nearest_texel(camera: KnownCamera, homogeneous: vec3f) -> vec2u {
    let at = homogeneous.xy / max(homogeneous.z, 1e-30);
    return vec2u(clamp(at, vec2f(0.0), vec2f(camera.columns, camera.rows) - 1.0));
}

{% include redundancy_test %}

fn is_redundant(candidate: Candidate) -> bool {
    var redundant = false;
{% if test_traces_rays %}
    for (var number = 0u; number < {{ earlier }}u && !redundant; number++) {
        redundant = is_redundant_with(candidate, number, known_cameras[number]);
    }
{% else %}
{% for number in range(earlier) %}
    redundant = is_redundant_with(candidate, {{ number }}u, known_cameras[{{ number }}]) || redundant;
{% endfor %}
{% endif %}
    return redundant;
}
