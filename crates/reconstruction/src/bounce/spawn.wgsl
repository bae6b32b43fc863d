// Rays off mirrors.
{% include "bounce/list.wgsl" %}

// The smallest mirror cell that holds a point, or the number after the last.
fn mirror_cell_at(point_in_world: vec3f) -> u32 {
    var found = MIRROR_CELLS;
    for (var i = 0u; i < MIRROR_CELLS && found == MIRROR_CELLS; i++) {
        let holds = all(point_in_world >= mirror_boxes[i].min_in_world) && all(point_in_world <= mirror_boxes[i].max_in_world);
        found = select(MIRROR_CELLS, i, holds);
    }
    return found;
}

// The mean curvature of a mirror in metres⁻¹, positive where convex: how much its normal turns from sample to sample, across the
// line of sight. Slanting does not count, which lengthens the way along it alone. Normals far apart are an edge, which counts
// as flat.
fn curvature_at(camera: SampleCamera, cell_index: u32, point_in_world: vec3f, side_m: f32) -> f32 {
    let sight = unit_or_zero(point_in_world - camera.eye_in_world);
    let normal = unit_from_oct16(sample_texel(cell_index, 0u).x);
    let beside = unit_from_oct16(sample_texel(cell_index + 1u, 0u).x);
    let below = unit_from_oct16(sample_texel(cell_index + camera.width_px, 0u).x);
    let forward = camera.homogeneous_pixel_from_world[2].xyz;
    let column = camera.homogeneous_pixel_from_world[0].xyz;
    let row = camera.homogeneous_pixel_from_world[1].xyz;
    let turn = turn_across(beside - normal, column - forward * dot(column, forward), sight)
        + turn_across(below - normal, row - forward * dot(row, forward), sight);
    let is_smooth = min(dot(normal, beside), dot(normal, below)) > EDGE_COSINE;
    return select(0.0, 0.5 * turn / side_m, is_smooth);
}

// The turn along an image axis, of which only the part across the line of sight is seen.
fn turn_across(turn: vec3f, along: vec3f, sight: vec3f) -> f32 {
    let axis = unit_or_zero(along);
    let across = axis - sight * dot(axis, sight);
    return dot(turn, across) / max(dot(across, across), 1e-6);
}

// A pixel's footprint on a mirror: its side, and what that grows by in a metre (Akenine-Möller et al. 2019).
struct Cone { width_m: f32, spread: f32 }

fn cone_off(before: Cone, curvature: f32) -> Cone {
    return Cone(before.width_m, before.spread + 2.0 * curvature * before.width_m);
}

// Lists the ray off a mirror. Gives what the mirror shows of the environment where no cell knows its surroundings. A base is a cell
// that holds all mirrors.
// `open` is the share of the environment that reaches the mirror; `side_m` is a pixel's of the picture that shows the mirror,
// above which a ray in images begins.
fn bounce_off(mirror: Mirror, pixel: u32, throughput_linear: vec3f, open: f32, side_m: f32, cone: Cone) -> vec3f {
    let share = mirror_share(mirror.reflector.roughness);
    let towards = reflect(-mirror.towards_eye, mirror.normal);
    let passed = throughput_linear * environment_reflectance(mirror) * share;
    let cell = mirror_cell_at(mirror.point_in_world);
    for (var guessed = cell == MIRROR_CELLS; guessed; guessed = false) {
        return environment_mirrored(towards, max(mirror.reflector.roughness, LEAST_ROUGHNESS)) * passed * open;
    }
    for (var listed = max(max(passed.r, passed.g), passed.b) > 0.0; listed; listed = false) {
        let in_cube_m = mirror_boxes[cell].start_m;
        let near_m = select(START_FOOTPRINTS * side_m, in_cube_m, in_cube_m > 0.0) / max(dot(mirror.normal, towards), LEAST_RISE);
        let guess = pack4x8unorm(vec4f(open, mirror.reflector.roughness, 0.0, 0.0));
        list_ray(cell, MirroredRay(mirror.point_in_world, pixel, towards, guess, rgb9e5_from_linear(passed), near_m, cone.width_m, cone.spread));
    }
    return vec3f(0.0);
}
