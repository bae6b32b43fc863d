// What cameras before this one hold of the scene, and the test by which an image leaves out what they hold. The
// test is another template: `is_known(candidate, number, camera)`, of one candidate and one of those cameras.

struct KnownCamera {
    // Rows that take (point_in_world, 1) to (column · w, row · w, w), w the planar depth in metres.
    homogeneous_pixel_from_world: array<vec4f, 3>,
    eye_in_world: vec3f,
    // A pixel's side at a depth of one metre.
    footprint: f32,
    // From one pixel's direction to the next one's, at a depth of one metre.
    column_in_world: vec3f,
    columns: f32,
    row_in_world: vec3f,
    rows: f32,
    near_m: f32,
    padding_0: f32,
    padding_1: f32,
    padding_2: f32,
}

// A sample that the image would show.
struct Candidate {
    point_in_world: vec3f,
    reversed_depth: f32,
    normal: vec3f,
    // A pixel's length on the surface, in metres.
    footprint_m: f32,
    id: vec2u,
    pixel: vec2u,
}

// A layer a camera; a texel's inverse planar depth (0 without a sample), normal, instance and primitive.
@group({{ known_group }}) @binding(0) var known_samples: texture_2d_array<u32>;
@group({{ known_group }}) @binding(1) var<uniform> known_cameras: array<KnownCamera, {{ [earlier, 1] | max }}>;
// Of each pixel the reversed depth of the nearest candidate that was left out.
@group({{ known_group }}) @binding(2) var<storage, read_write> left_out: array<atomic<u32>>;

// Cosine of the most grazing angle at which a footprint still grows.
const LEAST_FACING: f32 = 0.01;

fn homogeneous_in(camera: KnownCamera, point_in_world: vec3f) -> vec3f {
    let rows = camera.homogeneous_pixel_from_world;
    let p = vec4f(point_in_world, 1.0);
    return vec3f(dot(rows[0], p), dot(rows[1], p), dot(rows[2], p));
}

// Whether it projects into the image: outside of it nothing is known.
fn is_in_view(camera: KnownCamera, homogeneous: vec3f) -> bool {
    let size = vec2f(camera.columns, camera.rows) * homogeneous.z;
    return homogeneous.z > camera.near_m && all(homogeneous.xy >= vec2f(0.0)) && all(homogeneous.xy < size);
}

// A pixel's length on a surface at this depth that is met at this angle.
fn stretched_footprint(planar_depth_m: f32, footprint: f32, normal: vec3f, sight: vec3f) -> f32 {
    let facing = abs(dot(normal, sight)) * inverseSqrt(max(dot(sight, sight), 1e-30));
    return planar_depth_m * footprint / max(facing, LEAST_FACING);
}

{% include leave_out %}

fn is_left_out(candidate: Candidate, place: u32) -> bool {
    var known = false;
{% if test_traces_rays %}
    for (var number = 0u; number < {{ earlier }}u && !known; number++) {
        known = is_known(candidate, number, known_cameras[number]);
    }
{% else %}
{% for number in range(earlier) %}
    for (var open = !known; open; open = false) {
        known = is_known(candidate, {{ number }}u, known_cameras[{{ number }}]);
    }
{% endfor %}
{% endif %}
    for (var left = known; left; left = false) {
        atomicMax(&left_out[place], bitcast<u32>(candidate.reversed_depth));
    }
    return known;
}
