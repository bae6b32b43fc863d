// Lages §4.2: a linear search along the view ray, entered only when inside for every camera that sees
// the point, refined by bisection; the colour comes from the most conservative camera, the one whose
// surface is closest.
{% include "color.wgsl" %}
{% include "sample_set.wgsl" %}
{% include "cell.wgsl" %}
{% include "surface.wgsl" %}

const BISECTIONS: u32 = 8u;

// Penetration in inverse metres, positive inside; far below 0 for a camera that does not see the point,
// and whether it does.
struct Depth { penetration: f32, seen: bool }

fn inside(camera: SampleCamera, p: vec3f) -> Depth {
    let inverse_w = 1.0 / p.z;
    let uv = p.xy * inverse_w;
    let cells = camera.cells;
    let clamped = clamp(uv, vec2f(0.5), cells + 0.49);
    let texel = vec2u(clamped);
{% if count_fetches %}    fetches += 1u;
{% endif %}
    // The first of the corners of the cell to its lower right.
    let cell_index = camera.first_cell + texel.y * camera.width_px + texel.x;
    let word = textureLoad(cell_codes, texel_of(cell_index), 0).x;
    let code = word & 0x7fffu;
    let penetration = (f32(code) - camera.code_offset) / camera.code_scale - inverse_w;
{% if holes %}
    // What lies before a sample whose ray passed other surfaces is not seen.
    let known = (word & 0x8000u) == 0u || penetration >= 0.0;
{% else %}
    let known = true;
{% endif %}
    return Depth(penetration, p.z > 0.0 && all(uv == clamped) && code != HOLE && known);
}

// How the cameras that see a point judge it: inside for all of them, and whether there are any.
struct Verdict { entered: bool, seen: bool }

fn verdict({% for k in range(cameras) %}camera{{ k }}: SampleCamera, p{{ k }}: vec3f, {% endfor %}) -> Verdict {
    var outside = false;
    var seen = false;
{% for k in range(cameras) %}
    let d{{ k }} = inside(camera{{ k }}, p{{ k }});
    seen = seen || d{{ k }}.seen;
    outside = outside || (d{{ k }}.seen && d{{ k }}.penetration < 0.0);
{% endfor %}
    return Verdict(seen && !outside, seen);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= work.view.size_px) { return; }
    let pixel = pixel_of(id.xy);
    let span = span_in_volume(work.view.eye_in_world, pixel.direction, work.view.near_m);
    if span.near > span.far {
        write_pixel(pixel.index, work.background_srgb8, 0.0, PROVENANCE_EMPTY);
        return;
    }
{% for k in range(cameras) %}
    // Loaded once: to the software device a word of a uniform is a load for each thread.
    let camera{{ k }} = work.cameras[{{ k }}];
    let a{{ k }} = homogeneous(camera{{ k }}.homogeneous_pixel_from_world, vec4f(work.view.eye_in_world, 1.0));
    let b{{ k }} = homogeneous(camera{{ k }}.homogeneous_pixel_from_world, vec4f(pixel.direction, 0.0));
{% endfor %}
    let stride = (span.far - span.near) / f32(work.view.steps);
    let proven = tile_start_m[pixel.tile];
    // The last step that is proven free need not be taken.
    var step = u32(clamp(floor((proven - span.near) / stride), 0.0, f32(work.view.steps)));
    var entered = false;
    var never_unseen = true;
    var t = span.near;
    for (; step <= work.view.steps && !entered; step++) {
        t = span.near + stride * f32(step);
        let v = verdict({% for k in range(cameras) %}camera{{ k }}, a{{ k }} + b{{ k }} * t, {% endfor %});
        entered = v.entered;
        never_unseen = never_unseen && v.seen;
    }
    var low = max(t - stride, span.near);
    var high = t;
    for (var i = 0u; i < BISECTIONS; i++) {
        let middle = 0.5 * (low + high);
        let entered_there = verdict({% for k in range(cameras) %}camera{{ k }}, a{{ k }} + b{{ k }} * middle, {% endfor %}).entered;
        high = select(high, middle, entered_there);
        low = select(middle, low, entered_there);
    }
    var closest = FAR_AWAY;
    var mask = 0u;
{% for k in range(cameras) %}
    let p{{ k }} = a{{ k }} + b{{ k }} * high;
    let d{{ k }} = inside(camera{{ k }}, p{{ k }});
    let gap{{ k }} = select(FAR_AWAY, d{{ k }}.penetration, d{{ k }}.seen);
    mask = select(mask, {{ 2 ** k }}u, gap{{ k }} < closest);
    closest = min(closest, gap{{ k }});
{% endfor %}
    // One image is read, whichever it is.
    var uv = vec2f(0.0);
    var first_cell = 0u;
    var width = 1u;
    var camera_bit = 0u;
{% for k in range(cameras) %}
    let chosen{{ k }} = mask == {{ 2 ** k }}u;
    uv = select(uv, clamp(p{{ k }}.xy / p{{ k }}.z - 0.5, vec2f(0.0), camera{{ k }}.cells - 0.01), chosen{{ k }});
    first_cell = select(first_cell, camera{{ k }}.first_cell, chosen{{ k }});
    width = select(width, camera{{ k }}.width_px, chosen{{ k }});
    camera_bit = select(camera_bit, camera{{ k }}.mask, chosen{{ k }});
{% endfor %}
    let cell = vec2u(uv);
    let at = uv - floor(uv);
    let colors = colors_of(first_cell + cell.y * width + cell.x).corners;
{% if holes %}
    // Holes have no colour.
    let held = corners_of(first_cell + cell.y * width + cell.x).codes > vec4f(0.5);
    let shares = select(vec4f(0.0), bilinear_shares(at), held);
    let sum = colors[0] * shares.x + colors[1] * shares.y + colors[2] * shares.z + colors[3] * shares.w;
    let color_linear = sum / max(dot(shares, vec4f(1.0)), 1e-6);
{% else %}
    let upper = mix(colors[0], colors[1], at.x);
    let lower = mix(colors[2], colors[3], at.x);
    let color_linear = mix(upper, lower, at.y);
{% endif %}
    let found = entered && mask != 0u;
    let missed = select(PROVENANCE_FILLED, PROVENANCE_EMPTY, never_unseen);
    let provenance = select(missed, PROVENANCE_HIT | (camera_bit << 8u), found);
    let color = select(work.background_srgb8, srgb8_from_linear(color_linear), found);
    write_pixel(pixel.index, color, select(0.0, 1.0 / high, found), provenance);
    if provenance == PROVENANCE_FILLED { leave_for_later(pixel.index); }
}
