// A walk along a ray through the samples of a layered depth cube. Space is in units of the cube's spacing from here on.
//
// Cells of 8 units say how far the empty cells ahead of a ray reach, or which brick they are. A brick is a mask of 4 × 4 × 4 voxels of 2
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
// Four bits for each octant of directions: the side of the largest cube of empty cells that begins with this one and lies ahead. Or, where
// the highest four are 0, the number of a brick.
@group(0) var cube_cells: texture_2d<u32>;
// The mask of a brick's voxels in two words, and its first leaf.
@group(0) var cube_bricks: texture_2d<u32>;
// A leaf's two entries of two words each: a sample's number, with a bit for each coordinate of its line among the voxel's four lines
// along an axis, and for the axis itself whether the next sample is the surface's other side; and its normal, its depth along the axis, and the
// axis in the highest two bits. With `MORE_ENTRIES` in the first word, a first entry, and the places of the first pair of others and of the
// one after their last.
@group(0) var cube_leaves: texture_2d<u32>;
const NO_ENTRY: u32 = 0xffffffffu;
// Two entries a texel.
@group(0) var cube_entries: texture_2d<u32>;

// The parameter of a ray that meets nothing.
const BEYOND_CUBE: f32 = 3.0e38;

struct CubeRay { origin: vec3f, direction: vec3f }

fn in_cube(v: vec4f) -> vec3f {
    return vec3f(dot(cube.cube_from_world[0], v), dot(cube.cube_from_world[1], v), dot(cube.cube_from_world[2], v));
}

fn cube_ray(origin_in_world: vec3f, direction_in_world: vec3f) -> CubeRay {
    let direction = in_cube(vec4f(direction_in_world, 0.0));
    let least = length(direction) * 1e-7;
    // No component may be 0: 0 · inf is NaN.
    let walked = select(direction, vec3f(least), abs(direction) < vec3f(least));
    return CubeRay(in_cube(vec4f(origin_in_world, 1.0)), walked);
}

// What a ray meets at `t`: a sample, the axis of its line, and the way from the sample to the place. `is_empty`: it meets nothing.
struct CubeHit { met: bool, is_empty: bool, t: f32, sample: u32, axis: u32, off: vec3f }

// The component along an axis first, then those along the two after it.
fn along(axis: u32, v: vec3f) -> vec3f { return select(select(v.zxy, v.yzx, axis == 1u), v, axis == 0u); }

// A cell, and its brick where it has samples. The reach is that of the empty cells ahead, and 0 for a brick.
struct Cell { place: vec3i, reach: i32, mask: vec2u, first_leaf: u32 }

fn cell_at(place: vec3i, octant: u32) -> Cell {
    let index = u32(place.x) + cube.columns * (u32(place.y) + cube.rows * u32(place.z));
    let word = textureLoad(cube_cells, texel_at(index), 0).x;
    var cell = Cell(place, i32((word >> (4u * octant)) & 15u), vec2u(0u), 0u);
    if (word >> 28u) == 0u {
        let words = textureLoad(cube_bricks, texel_at(word), 0);
        cell = Cell(place, 0, words.xy, words.z);
    }
    return cell;
}

// The largest box around a voxel that is known to be empty ahead, or the voxel itself where it has samples.
struct Box { least: vec3f, side: f32, is_leaf: bool }

fn box_at(voxel: vec3i, cell: Cell, rises: vec3<bool>) -> Box {
    let within = vec3u(voxel & vec3i(3));
    let layers = select(cell.mask.x, cell.mask.y, within.z >= 2u);
    let is_leaf = (layers & (1u << (within.x + 4u * within.y + 16u * (within.z & 1u)))) != 0u;
    // Of the 2 × 2 × 2 voxels of an octant.
    let octant = layers & (0x00330033u << (2u * (within.x >> 1u) + 8u * (within.y >> 1u)));
    let is_clear = all((cell.mask & mask_ahead(within, rises)) == vec2u(0u));
    let is_brick = cell.reach == 0;
    let in_brick = select(select(2, 4, octant == 0u), 8, is_clear);
    let of_cells = select(cell.place - cell.reach + 1, cell.place, rises) * 8;
    let least = select(of_cells, (voxel * 2) & vec3i(-in_brick), is_brick);
    return Box(vec3f(least), f32(select(8 * cell.reach, in_brick, is_brick)), is_leaf);
}

// The voxels of a brick that a ray can still come to.
fn mask_ahead(within: vec3u, rises: vec3<bool>) -> vec2u {
    let columns = select(15u >> (3u - within.x), (15u << within.x) & 15u, rises.x);
    let rows = select(0x1111u >> (12u - 4u * within.y), (0x1111u << (4u * within.y)) & 0xffffu, rises.y);
    let layers = select(15u >> (3u - within.z), (15u << within.z) & 15u, rises.z);
    let layer = columns * rows;
    let in_layers = vec4u(layer) * ((vec4u(layers) >> vec4u(0u, 1u, 2u, 3u)) & vec4u(1u));
    return in_layers.xz | (in_layers.yw << vec2u(16u));
}

// The nearest surface on a ray, from `near` to `far`.
fn walk(from_eye: CubeRay, near: f32, far: f32) -> CubeHit {
    let inverse = 1.0 / from_eye.direction;
    let a = -from_eye.origin * inverse;
    let b = (vec3f(cube.size) - from_eye.origin) * inverse;
    let lower = min(a, b);
    let upper = max(a, b);
    let start = max(max(lower.x, lower.y), max(lower.z, near));
    // The walk counts from where the ray comes into the cube: beside the way there a spacing may be less than a rounding.
    let end = min(min(upper.x, upper.y), min(upper.z, far)) - start;
    let ray = CubeRay(from_eye.origin + from_eye.direction * start, from_eye.direction);
    let from_face = -ray.origin * inverse;
    let nudge = WALK_NUDGE * inverseSqrt(dot(ray.direction, ray.direction));
    let slack = nudge * (HIT_SLACK / WALK_NUDGE);
    let last_voxel = (vec3i(cube.size) - 1) / 2;
    let rises = ray.direction > vec3f(0.0);
    let ahead = select(vec3f(0.0), vec3f(1.0), rises);
    let octant = dot(vec3u(rises), vec3u(1u, 2u, 4u));
    // A place on a face belongs to the voxel that the ray goes into.
    let into_voxel = (ahead * 2.0 - 1.0) * WALK_NUDGE;
    var t = nudge;
    var hit = CubeHit(false, false, BEYOND_CUBE, 0u, 0u, vec3f(0.0));
    var cell = Cell(vec3i(-1), 0, vec2u(0u), 0u);
    var step = 0u;
    while t < end && step < MAX_CUBE_STEPS && !hit.met {
        var voxel = vec3i(0);
        var out = t;
        var is_leaf = false;
        // A ray that has come to a leaf waits for those beside it: all look into their leaves at once.
        for (; !is_leaf && t < end && step < MAX_CUBE_STEPS; step++) {
            voxel = clamp(vec3i((ray.origin + ray.direction * t + into_voxel) * 0.5), vec3i(0), last_voxel);
            let place = voxel >> vec3u(2u);
            if any(place != cell.place) { cell = cell_at(place, octant); }
            let around = box_at(voxel, cell, rises);
            is_leaf = around.is_leaf;
            // Where the ray leaves the box.
            let ends = (around.least + ahead * around.side) * inverse + from_face;
            out = max(t, min(min(ends.x, ends.y), ends.z));
            t = select(out + nudge, t, is_leaf);
        }
        if is_leaf {
            hit = met_in_leaf(ray, voxel, cell, vec2f(max(t - slack, near - start), out + slack));
            t = out + nudge;
        }
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
    let leaf = textureLoad(cube_leaves, texel_at(cell.first_leaf + before), 0);
    let in_voxel = CubeRay(ray.origin - vec3f(voxel * 2), ray.direction);
    var nearest = nearer_of(Met(span.y, vec2u(NO_ENTRY)), in_voxel, leaf.xy, span.x);
    let is_long = (leaf.x & MORE_ENTRIES) != 0u;
    nearest = nearer_of(nearest, in_voxel, select(leaf.zw, leaf.xy, is_long), span.x);
    for (var pair = select(leaf.w, leaf.z, is_long); pair < leaf.w; pair++) {
        let entries = textureLoad(cube_entries, texel_at(pair), 0);
        nearest = nearer_of(nearest, in_voxel, entries.xy, span.x);
        nearest = nearer_of(nearest, in_voxel, entries.zw, span.x);
    }
    let off = in_voxel.origin + ray.direction * nearest.t - place_of_entry(nearest.words);
    return CubeHit(nearest.words.x != NO_ENTRY, false, nearest.t, nearest.words.x & 0x0fffffffu, nearest.words.y >> 30u, off);
}

// What a ray meets in a leaf: the entry's words, and the ray's parameter there.
struct Met { t: f32, words: vec2u }

// Whether an entry's line runs along each axis.
fn is_axis(words: vec2u) -> vec3<bool> { return vec3u(words.y >> 30u) == vec3u(0u, 1u, 2u); }

fn bits_of_entry(words: vec2u) -> vec3u { return vec3u(words.x >> 28u, words.x >> 29u, words.x >> 30u) & vec3u(1u); }

// Of an entry's sample, in its voxel.
fn place_of_entry(words: vec2u) -> vec3f {
    let depth = f32((words.y >> 16u) & 0x3fffu) * ENTRY_DEPTH_STEP - ENTRY_DEPTH_BELOW;
    return select(vec3f(bits_of_entry(words)) + 0.5, vec3f(depth), is_axis(words));
}

// The nearer of what is met and of where the ray meets an entry's plane from a side that is seen, from `near` on and within the
// line's square.
fn nearer_of(nearest: Met, in_voxel: CubeRay, words: vec2u, near: f32) -> Met {
    let way = place_of_entry(words) - in_voxel.origin;
    let flat = unpack4x8snorm(words.y).xy;
    let z = 1.0 - abs(flat.x) - abs(flat.y);
    let normal = vec3f(select(flat, oct_wrapped(flat), z < 0.0), z);
    let facing = dot(normal, in_voxel.direction);
    let t = dot(normal, way) / select(facing, -1e-20, facing == 0.0);
    let off = abs(in_voxel.direction * t - way);
    let is_along = is_axis(words);
    let is_within = all((off <= vec3f(SQUARE_REACH)) | is_along);
{%- if meets_both_sides is defined and meets_both_sides %}
    let is_seen = true;
{%- else %}
    let is_seen = facing < 0.0 || any(is_along & (bits_of_entry(words) != vec3u(0u)));
{%- endif %}
    let is_met = is_seen && t >= near && t < nearest.t && is_within;
    let side = vec2u(words.x + select(0u, 1u, facing > 0.0), words.y);
    return Met(select(nearest.t, t, is_met), select(nearest.words, side, is_met));
}
