// A walk along a ray through the samples of a layered depth cube. Space is in units of the cube's spacing from here on.
//
// Cells of 8 units say how far the nearest cell with samples is, or which brick they are. A brick is a mask of 4 × 4 × 4 voxels of 2
// units. A voxel with samples is a leaf of entries: each is a sample whose plane passes through the voxel, within its line's square.

struct Cube {
    // Rows that take (point_in_world, 1) to the cube's space.
    cube_from_world: array<vec4f, 3>,
    // Columns, rows and layers of cells of one unit.
    size: vec3u,
    // Of the cells of 8 units.
    columns: u32,
    rows: u32,
    // A ray that leaves a surface straight up meets nothing nearer.
    start_m: f32,
    padding: vec2u,
}

@group(0) var<uniform> cube: Cube;
const IS_BRICK: u32 = 0x80000000u;
// The distance to the nearest cell with samples, in cells; with the highest bit, the number of a brick.
@group(0) var cube_cells: texture_2d<u32>;
// The mask of a brick's voxels in two words, and its first leaf.
@group(0) var cube_bricks: texture_2d<u32>;
// The first pair of entries of a leaf, and the one after its last.
@group(0) var cube_leaves: texture_2d<u32>;
// Two entries a texel, of two words each: a sample's number, with a bit for each coordinate of its line among the voxel's four lines
// along an axis; and its normal, its depth along the axis, and the axis in the highest two bits.
@group(0) var cube_entries: texture_2d<u32>;

struct CubeRay { origin: vec3f, direction: vec3f }

fn cube_ray(origin_in_world: vec3f, direction_in_world: vec3f) -> CubeRay {
    let direction = homogeneous(cube.cube_from_world, vec4f(direction_in_world, 0.0));
    let least = length(direction) * 1e-7;
    // No component may be 0: 0 · inf is NaN.
    let walked = select(direction, vec3f(least), abs(direction) < vec3f(least));
    return CubeRay(homogeneous(cube.cube_from_world, vec4f(origin_in_world, 1.0)), walked);
}

// What a ray meets at `t`: a sample, the axis of its line, and the way from the sample to the place. `is_empty`: it meets nothing.
struct CubeHit { met: bool, is_empty: bool, t: f32, sample: u32, axis: u32, off: vec3f }

// The component along an axis first, then those along the two after it.
fn along(axis: u32, v: vec3f) -> vec3f { return select(select(v.zxy, v.yzx, axis == 1u), v, axis == 0u); }

// A cell, and its brick where it has samples.
struct Cell { place: vec3i, word: u32, mask: vec2u, first_leaf: u32 }

fn cell_at(place: vec3i) -> Cell {
{% if count_fetches %}    fetches += 1u;
{% endif %}
    let index = u32(place.x) + cube.columns * (u32(place.y) + cube.rows * u32(place.z));
    var cell = Cell(place, textureLoad(cube_cells, texel_at(index), 0).x, vec2u(0u), 0u);
    if (cell.word & IS_BRICK) != 0u {
{% if count_fetches %}        fetches += 1u;
{% endif %}
        let words = textureLoad(cube_bricks, texel_at(cell.word & ~IS_BRICK), 0);
        cell.mask = words.xy;
        cell.first_leaf = words.z;
    }
    return cell;
}

// The largest box around a voxel that is known to be empty, or the voxel itself where it has samples.
struct Box { least: vec3f, side: f32, is_leaf: bool }

fn box_at(voxel: vec3i, cell: Cell) -> Box {
    let within = vec3u(voxel & vec3i(3));
    let layers = select(cell.mask.x, cell.mask.y, within.z >= 2u);
    let is_leaf = (layers & (1u << (within.x + 4u * within.y + 16u * (within.z & 1u)))) != 0u;
    // Of the 2 × 2 × 2 voxels of an octant.
    let octant = layers & (0x00330033u << (2u * (within.x >> 1u) + 8u * (within.y >> 1u)));
    let reach = i32(cell.word) - 1;
    let is_brick = (cell.word & IS_BRICK) != 0u;
    let in_brick = select(4, 2, octant != 0u);
    let least = select((cell.place - reach) * 8, (voxel * 2) & vec3i(-in_brick), is_brick);
    return Box(vec3f(least), f32(select(16 * reach + 8, in_brick, is_brick)), is_leaf);
}

// The nearest surface on a ray, from `near` on.
fn walk(from_eye: CubeRay, near: f32) -> CubeHit {
    let inverse = 1.0 / from_eye.direction;
    let a = -from_eye.origin * inverse;
    let b = (vec3f(cube.size) - from_eye.origin) * inverse;
    let lower = min(a, b);
    let upper = max(a, b);
    let start = max(max(lower.x, lower.y), max(lower.z, near));
    // The walk counts from where the ray comes into the cube: beside the way there a spacing may be less than a rounding.
    let end = min(min(upper.x, upper.y), upper.z) - start;
    let ray = CubeRay(from_eye.origin + from_eye.direction * start, from_eye.direction);
    let from_face = -ray.origin * inverse;
    let nudge = WALK_NUDGE * inverseSqrt(dot(ray.direction, ray.direction));
    let slack = nudge * (HIT_SLACK / WALK_NUDGE);
    let last_voxel = (vec3i(cube.size) - 1) / 2;
    let ahead = select(vec3f(0.0), vec3f(1.0), ray.direction > vec3f(0.0));
    // A place on a face belongs to the voxel that the ray goes into.
    let into_voxel = (ahead * 2.0 - 1.0) * WALK_NUDGE;
    var t = nudge;
    var hit = CubeHit(false, false, FAR_AWAY, 0u, 0u, vec3f(0.0));
    var cell = Cell(vec3i(-1), 0u, vec2u(0u), 0u);
    for (var step = 0u; step < MAX_CUBE_STEPS && t < end && !hit.met; step++) {
        let voxel = clamp(vec3i(floor((ray.origin + ray.direction * t + into_voxel) * 0.5)), vec3i(0), last_voxel);
        let place = voxel >> vec3u(2u);
        if any(place != cell.place) { cell = cell_at(place); }
        let around = box_at(voxel, cell);
        // Where the ray leaves the box.
        let ends = (around.least + ahead * around.side) * inverse + from_face;
        let out = min(min(ends.x, ends.y), ends.z);
        if around.is_leaf {
            hit = met_in_leaf(ray, voxel, cell, vec2f(max(t - slack, near - start), out + slack));
        }
        t = max(out, t) + nudge;
    }
    hit.t += start;
    hit.is_empty = !hit.met && t >= end;
    return hit;
}

fn met_in_leaf(ray: CubeRay, voxel: vec3i, cell: Cell, span: vec2f) -> CubeHit {
    let within = vec3u(voxel & vec3i(3));
    let bit = 1u << (within.x + 4u * within.y + 16u * (within.z & 1u));
    let before = countOneBits(select(cell.mask.x, cell.mask.y, within.z >= 2u) & (bit - 1u))
        + select(0u, countOneBits(cell.mask.x), within.z >= 2u);
{% if count_fetches %}    fetches += 1u;
{% endif %}
    let ends = textureLoad(cube_leaves, texel_at(cell.first_leaf + before), 0).xy;
    var hit = CubeHit(false, false, FAR_AWAY, 0u, 0u, vec3f(0.0));
    for (var pair = ends.x; pair < ends.y; pair++) {
{% if count_fetches %}        fetches += 1u;
{% endif %}
        let entries = textureLoad(cube_entries, texel_at(pair), 0);
        hit = nearer_of(hit, ray, entries.xy, vec3f(voxel * 2), span);
        hit = nearer_of(hit, ray, entries.zw, vec3f(voxel * 2), span);
    }
    return hit;
}

// The nearer of a hit and of where the ray meets an entry's plane from its front, within the voxel and the line's square.
fn nearer_of(hit: CubeHit, ray: CubeRay, words: vec2u, voxel_least: vec3f, span: vec2f) -> CubeHit {
    let axis = words.y >> 30u;
    let is_along = vec3u(axis) == vec3u(0u, 1u, 2u);
    let depth = f32((words.y >> 16u) & 0x3fffu) * ENTRY_DEPTH_STEP - ENTRY_DEPTH_BELOW;
    let line = vec3f(vec3u(words.x >> 28u, words.x >> 29u, words.x >> 30u) & vec3u(1u)) + 0.5;
    let sample = voxel_least + select(line, vec3f(depth), is_along);
    let flat = unpack4x8snorm(words.y).xy;
    let z = 1.0 - abs(flat.x) - abs(flat.y);
    let normal = vec3f(select(flat, oct_wrapped(flat), z < 0.0), z);
    let facing = dot(normal, ray.direction);
    let t = dot(normal, sample - ray.origin) / select(facing, -1e-20, facing >= 0.0);
    let off = ray.origin + ray.direction * t - sample;
    let is_within = all((abs(off) <= vec3f(SQUARE_REACH)) | is_along);
    let is_met = facing < 0.0 && t >= span.x && t <= span.y && t < hit.t && is_within;
    var nearer = hit;
    nearer.met = hit.met || is_met;
    nearer.t = select(hit.t, t, is_met);
    nearer.sample = select(hit.sample, words.x & 0x0fffffffu, is_met);
    nearer.axis = select(hit.axis, axis, is_met);
    nearer.off = select(hit.off, off, is_met);
    return nearer;
}
