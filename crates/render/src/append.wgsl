// Keeps all surfaces that the lines of a parallel camera meet, whichever lies before another.

// What the lines of a parallel camera have in common.
struct Lines {
    forward_in_world: vec3f,
    spacing_m: f32,
    range_m: f32,
    columns: u32,
    // Surfaces are left out where the share of their normal along the lines is less than this of its greatest along an axis.
    least_share: f32,
    capacity: u32,
}
// Where a line meets a surface, on one of its sides.
struct Crossing {
    line: u32,
    planar_depth_m: f32,
    // Of the triangle.
    plane_normal_oct16: u32,
    surface: vec4u,
}
@group(3) var<uniform> lines: Lines;
@group(3) var<storage, read_write> crossings: array<Crossing>;
// The number of crossings, whether there was room for them or not.
@group(3) var<storage, read_write> crossing_count: atomic<u32>;

// Keeps both sides of what is seen from both.
fn append(in: Varyings, surface: vec4u, normal: vec3f, slope: Slope, front_facing: bool) {
    let sides = {{ "2u" if double_sided else "1u" }};
    // What there is no room for is written behind the rest. A branch that a uniform decides makes Mesa 22.3 fail.
    let place = min(atomicAdd(&crossing_count, sides), lines.capacity);
    let pixel = vec2u(in.clip.xy);
    let line = pixel.y * lines.columns + pixel.x;
    let depth_m = clamp(in.clip.z, 0.0, 1.0) * lines.range_m;
    let front = select(-slope.towards, slope.towards, front_facing);
    crossings[place] = Crossing(line, depth_m, oct16_from_unit(front), surface);
{%- if double_sided %}
    crossings[place + 1u] = Crossing(line, depth_m, oct16_from_unit(-front), vec4u(surface.xy, oct16_from_unit(-normal), surface.w));
{%- endif %}
}

// A triangle's normal towards the camera, and whether too little of it lies along the lines.
struct Slope { towards: vec3f, is_steep: bool }

fn slope_of(along_row: vec3f, along_column: vec3f) -> Slope {
    let rises = abs(vec2f(dot(along_row, lines.forward_in_world), dot(along_column, lines.forward_in_world)));
    return Slope(normalize(cross(along_column, along_row)), max(rises.x, rises.y) * lines.least_share > lines.spacing_m);
}
