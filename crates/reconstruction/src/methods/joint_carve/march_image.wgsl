{# The march in one camera's image. Mirrored rays are marched in several cameras, one of which each function is given. #}
{%- set camera = "camera" if bounced else "work.cameras[CAMERA]" %}
{%- set given = ", camera: SampleCamera" if bounced else "" %}
{%- set passed = ", camera" if bounced else "" -%}
// How far the way is free, and whether it ends at a surface.
struct March { t: f32, crossed: bool }

// `origin + line · s`, in columns, rows and codes, up to where the line leaves the image.
struct Line { origin: vec3f, line: vec3f, inverse: vec2f, forwards: vec2f, s_end: f32 }

fn line_between(origin: vec3f, to: vec3f{{ given }}) -> Line {
    let cells = {{ camera }}.cells;
    let line = to - origin;
    let inverse = 1.0 / select(line.xy, vec2f(1e-9), abs(line.xy) < vec2f(1e-9));
    let border = (select(vec2f(0.0), cells, inverse > vec2f(0.0)) - origin.xy) * inverse;
    return Line(origin, line, inverse, vec2f(inverse > vec2f(0.0)), min(min(border.x, border.y), 1.0));
}

// Where a square of the image is left, seen from s.
fn exit_of(line: Line, s: f32, low: vec2f, side: f32) -> f32 {
    let nudge = (line.forwards * 2.0 - 1.0) * NUDGE_PX;
    let leave = (low + line.forwards * side + nudge - line.origin.xy) * line.inverse;
    return clamp(min(leave.x, leave.y), s, line.s_end);
}

// How far a part of the march got, and how it ended.
struct Progress { s: f32, ended: bool }

// Through nodes in which everything is farther away; ends before 2 × 2 cells that may hold a surface.
fn march_nodes(line: Line, begin: f32{{ given }}) -> Progress {
    let cells = {{ camera }}.cells;
    let log2_sides = {{ camera }}.log2_sides;
    let first_node = {{ camera }}.first_node;
    // A small image has fewer levels.
    let start_level = min({{ "BOUNCE_LEVEL" if bounced else "START_LEVEL" }}, top_level(log2_sides));
    var s = begin;
    var level = start_level;
    var blocked = false;
    for (var i = 0u; i < MAX_COARSE_MOVES && s < line.s_end && !blocked; i++) {
        let at = line.origin + line.line * s;
        let node = vec2u(clamp(at.xy, vec2f(0.0), cells)) >> vec2u(level);
        let size = f32(1u << level);
        let exit = exit_of(line, s, vec2f(node) * size, size);
        let nearest = nearest_code(textureLoad(nodes, texel_at(first_node + node_index(log2_sides, level, node)), 0).x);
        let free = min(at.z, line.origin.z + line.line.z * exit) > nearest || nearest < FIRST_SAMPLE;
        let surface = (nearest - line.origin.z) * safe_reciprocal(line.line.z);
        let partial = select(s, clamp(surface, s, exit), at.z > nearest && line.line.z < 0.0);
        blocked = !free && level == 1u;
        s = select(partial, exit, free);
        level = select(max(level, 2u) - 1u, min(level + 1u, start_level), free);
    }
    return Progress(s, blocked);
}

// From cell to cell, to where the ray crosses the surface or is found behind it.
fn march_cells(line: Line, begin: Progress{{ given }}) -> Progress {
    let cells = {{ camera }}.cells;
    let first_cell = {{ camera }}.first_cell;
    let width_px = {{ camera }}.width_px;
    var s = begin.s;
    var marching = begin.ended;
    var crossed = false;
    for (var i = 0u; i < MAX_FINE_MOVES && marching && s < line.s_end; i++) {
        let at = line.origin + line.line * s;
        let cell = floor(clamp(at.xy, vec2f(0.0), cells - CELL_MARGIN_PX));
        let exit = exit_of(line, s, cell, 1.0);
        let beyond = line.origin + line.line * exit;
        let node = vec2u(cell);
        let corners = corners_of(first_cell + node.y * width_px + node.x);
        let hole = {% if holes %}!corners.certain{% else %}min(min(corners.codes.x, corners.codes.y), min(corners.codes.z, corners.codes.w)) < 0.5{% endif %};
        let inside = at.xy - cell;
        let inside_beyond = clamp(beyond.xy - cell, vec2f(0.0), vec2f(1.0));
        let here = HALF_CODE + at.z - surface_code(corners, inside);
        let there = HALF_CODE + beyond.z - surface_code(corners, inside_beyond);
        let through = here > 0.0 && there > 0.0 && !hole;
        crossed = here > 0.0 && there <= 0.0 && !hole;
        let crossing = s + (exit - s) * here / max(here - there, 1e-9);
        s = select(select(s, crossing, crossed), exit, through);
        marching = through;
    }
    return Progress(s, crossed);
}

fn march(a: vec3f, b: vec3f, near: f32, far: f32{{ given }}) -> March {
    let scale = {{ camera }}.code_scale;
    let offset = {{ camera }}.code_offset;
    let p0 = a + b * near;
    // The line ends before the plane through the camera's eye.
    let end = select(far, min(far, (EYE_SHARE * p0.z - a.z) * safe_reciprocal(b.z)), b.z < 0.0);
    let p1 = a + b * end;
    let origin = vec3f(p0.xy / p0.z - 0.5, scale / p0.z + offset);
    let line = line_between(origin, vec3f(p1.xy / p1.z - 0.5, scale / p1.z + offset){{ passed }});
    let visible = p0.z > 0.0 && all(origin.xy >= vec2f(0.0)) && all(origin.xy < {{ camera }}.cells);
    let blocked = march_nodes(line, select(line.s_end, 0.0, visible){{ passed }});
    let found = march_cells(line, blocked{{ passed }});
    // Back to the ray's own parameter: 1/w is linear in s.
    let share = found.s * p0.z / ((1.0 - found.s) * p1.z + found.s * p0.z);
    return March(select(near, near + (end - near) * share, visible), found.ended);
}
