// Lages §4.2: a linear search along the view ray, refined by bisection. A surface is entered where the point is inside for
// every camera that sees it. The colour comes from the most conservative camera, the one whose surface is closest.
{% include "surface.wgsl" %}

@group(0) var<storage, read> tile_start_m: array<f32>;
// From where a ray enters the volume to where it leaves it.
@group(0) var<uniform> steps: u32;

// Penetration in inverse metres, positive inside; `seen`: the camera sees the point.
struct Depth { penetration: f32, seen: bool }

fn depth_in(camera: SampleCamera, p: vec3f) -> Depth {
    let inverse_w = 1.0 / p.z;
    let uv = p.xy * inverse_w;
    let cells = camera.cells;
    let clamped = clamp(uv, vec2f(0.5), cells + 0.49);
    let texel = vec2u(clamped);
    // The first of the corners of the cell to its lower right.
    let cell_index = camera.first_cell + texel.y * camera.width_px + texel.x;
    let word = textureLoad(cell_codes, texel_at(cell_index), 0).x;
    let code = word & 0x7fffu;
    let penetration = (f32(code) - camera.code_offset) / camera.code_scale - inverse_w;
{% if holes %}
    // The space before a sample whose ray passed other surfaces is not seen.
    let known = (word & 0x8000u) == 0u || penetration >= 0.0;
{% else %}
    let known = true;
{% endif %}
    return Depth(penetration, p.z > 0.0 && all(uv == clamped) && code != HOLE_CODE && known);
}

// The ray in the images of all cameras, a + b · t in each.
struct ImageRays {
{% for k in range(cameras) %}
    camera{{ k }}: SampleCamera, a{{ k }}: vec3f, b{{ k }}: vec3f,
{% endfor %}
}

fn image_rays(direction: vec3f) -> ImageRays {
    var rays: ImageRays;
{% for k in range(cameras) %}
    // Loaded once: to the software device a word of a uniform is a load for each thread.
    rays.camera{{ k }} = work.cameras[{{ k }}];
    rays.a{{ k }} = homogeneous(rays.camera{{ k }}.homogeneous_pixel_from_world, vec4f(work.view.eye_in_world, 1.0));
    rays.b{{ k }} = homogeneous(rays.camera{{ k }}.homogeneous_pixel_from_world, vec4f(direction, 0.0));
{% endfor %}
    return rays;
}

// `entered`: the point is inside for all cameras that see it; `seen`: some camera does.
struct Evaluation { entered: bool, seen: bool }

fn evaluate_cameras(rays: ImageRays, t: f32) -> Evaluation {
    var outside = false;
    var seen = false;
{% for k in range(cameras) %}
    let d{{ k }} = depth_in(rays.camera{{ k }}, rays.a{{ k }} + rays.b{{ k }} * t);
    seen = seen || d{{ k }}.seen;
    outside = outside || (d{{ k }}.seen && d{{ k }}.penetration < 0.0);
{% endfor %}
    return Evaluation(seen && !outside, seen);
}

// Where the ray enters, and whether some camera sees all of the way to there.
struct Found { t: f32, entered: bool, never_unseen: bool }

fn search(rays: ImageRays, span: Span, proven_until: f32) -> Found {
    let stride = (span.far - span.near) / f32(steps);
    // The last step that is proven free need not be taken.
    var step = u32(clamp(floor((proven_until - span.near) / stride), 0.0, f32(steps)));
    var entered = false;
    var never_unseen = true;
    var t = span.near;
    for (; step <= steps && !entered; step++) {
        t = span.near + stride * f32(step);
        let v = evaluate_cameras(rays, t);
        entered = v.entered;
        never_unseen = never_unseen && v.seen;
    }
    var low = max(t - stride, span.near);
    var high = t;
    for (var i = 0u; i < BISECTIONS; i++) {
        let middle = 0.5 * (low + high);
        let entered_there = evaluate_cameras(rays, middle).entered;
        high = select(high, middle, entered_there);
        low = select(middle, low, entered_there);
    }
    return Found(high, entered, never_unseen);
}

// A place in the image of the most conservative camera; `mask` is 0 where none sees the point.
struct Place { uv: vec2f, first_cell: u32, width_px: u32, mask: u32 }

fn most_conservative(rays: ImageRays, t: f32) -> Place {
    var closest = FAR_AWAY;
    var chosen = 0u;
{% for k in range(cameras) %}
    let p{{ k }} = rays.a{{ k }} + rays.b{{ k }} * t;
    let d{{ k }} = depth_in(rays.camera{{ k }}, p{{ k }});
    let gap{{ k }} = select(FAR_AWAY, d{{ k }}.penetration, d{{ k }}.seen);
    chosen = select(chosen, {{ 2 ** k }}u, gap{{ k }} < closest);
    closest = min(closest, gap{{ k }});
{% endfor %}
    // One image is read, whichever it is.
    var place = Place(vec2f(0.0), 0u, 1u, 0u);
{% for k in range(cameras) %}
    let is{{ k }} = chosen == {{ 2 ** k }}u;
    let uv{{ k }} = clamp(p{{ k }}.xy / p{{ k }}.z - 0.5, vec2f(0.0), rays.camera{{ k }}.cells - CELL_MARGIN_PX);
    place.uv = select(place.uv, uv{{ k }}, is{{ k }});
    place.first_cell = select(place.first_cell, rays.camera{{ k }}.first_cell, is{{ k }});
    place.width_px = select(place.width_px, rays.camera{{ k }}.width_px, is{{ k }});
    place.mask = select(place.mask, rays.camera{{ k }}.mask, is{{ k }});
{% endfor %}
    return place;
}

fn color_at(place: Place) -> vec3f {
    let cell = vec2u(place.uv);
    let at = place.uv - floor(place.uv);
    let cell_index = place.first_cell + cell.y * place.width_px + cell.x;
    let colors = colors_of(cell_index).corners;
{% if holes %}
    // Holes have no colour.
    let held = corners_of(cell_index).codes > vec4f(0.5);
    let shares = select(vec4f(0.0), bilinear_shares(at), held);
    let sum = colors[0] * shares.x + colors[1] * shares.y + colors[2] * shares.z + colors[3] * shares.w;
    return sum / max(dot(shares, vec4f(1.0)), 1e-6);
{% else %}
    let upper = mix(colors[0], colors[1], at.x);
    let lower = mix(colors[2], colors[3], at.x);
    return mix(upper, lower, at.y);
{% endif %}
}

@compute @workgroup_size({{ "LIST_WORKGROUP" if listed else "TILE_PX, TILE_PX" }})
fn main(@builtin(global_invocation_id) id: vec3u) {
{% include "at_pixel.wgsl" %}
    let pixel = pixel_of(place);
    let span = span_in_volume(work.view.eye_in_world, pixel.direction, work.view.near_m);
    if span.near > span.far {
        write_pixel(pixel.index, 0u, 0.0, PROVENANCE_EMPTY);
        return;
    }
    let rays = image_rays(pixel.direction);
    let found = search(rays, span, tile_start_m[pixel.tile]);
    let seen_at = most_conservative(rays, found.t);
    let hit = found.entered && seen_at.mask != 0u;
    write_found(pixel.index, hit, found.t, color_at(seen_at), origin_of(seen_at.mask, 0u), found.never_unseen);
}
