// Mirrored rays in images of single-pole cameras, where they are curves: the walk of Rosen et al., section 3.2, in coarse steps,
// and in fine ones where a coarse step may meet the surface.
{% include "color.wgsl" %}
{% include "view_work.wgsl" %}
{% include "cell.wgsl" %}
{% include "surface.wgsl" %}
{% include "pixel_list.wgsl" %}
{% include "bounce/ray.wgsl" %}
{% include "single_pole.wgsl" %}
@group(0) var<storage, read> rays: array<MirroredRay>;

// Linear along a ray: columns and rows before they move, and inverse depth.
struct Line { origin: vec3f, line: vec3f }

// The image at a place of a line. `gap`, in codes, is positive before the surface, and FAR_AWAY where there is none.
struct Look { place: vec2f, gap: f32, footprint: f32, connected: bool, inside: bool }

fn look_at(line: Line, s: f32, camera: SampleCamera, pole: Pole) -> Look {
    let at = line.origin + line.line * s;
    let place = moved(pole, at.xy, at.z) - 0.5;
    let inside = all(place >= vec2f(0.0)) && all(place < camera.cells);
    let clamped = clamp(place, vec2f(0.0), camera.cells - CELL_MARGIN_PX);
    let cell = vec2u(clamped);
    let within = clamped - floor(clamped);
    let corners = corners_of(camera.first_cell + cell.y * camera.width_px + cell.x);
    let own = select(
        select(corners.codes.x, corners.codes.y, within.x >= 0.5),
        select(corners.codes.z, corners.codes.w, within.x >= 0.5),
        within.y >= 0.5,
    );
    let surface = select(own, bilinear(corners.codes, within), corners.connected);
    let code_above = camera.code_scale * at.z;
    let gap = HALF_CODE + code_above + camera.code_offset - surface;
    return Look(place, select(FAR_AWAY, gap, inside && surface >= FIRST_SAMPLE), code_above / camera.focal_px, corners.connected, inside);
}

// A coarse step does not meet the surface where both of its ends are well before it, or well behind it: as far as a surface
// that rises by a footprint in a texel may come near from the nearer end.
fn may_meet(a: Look, b: Look, coarse_px: f32) -> bool {
    let fuzzy = 0.5 * coarse_px * max(a.footprint, b.footprint);
    return min(a.gap, b.gap) <= fuzzy && max(a.gap, b.gap) >= -fuzzy;
}

// A fine step meets a surface that goes on from end to end, or one whose sample it ends close behind.
fn meets(a: Look, b: Look) -> bool {
    let close = b.gap >= -THICKNESS_FOOTPRINTS * b.footprint;
    return a.gap > 0.0 && b.gap <= 0.0 && (close || (a.connected && b.connected));
}

// `free`: the ray is before all surfaces, up to its end.
struct Walk { s: f32, met: bool, free: bool }

fn walk(line: Line, camera: SampleCamera, pole: Pole) -> Walk {
    var here = look_at(line, 0.0, camera, pole);
    let chord_px = distance(here.place, moved(pole, line.origin.xy + line.line.xy, line.origin.z + line.line.z) - 0.5);
    let coarse_step = min(poles.coarse_px / max(chord_px, 1e-3), 1.0);
    let fine_steps = u32(ceil(poles.coarse_px / poles.fine_px));
    let fine_step = coarse_step / f32(fine_steps);
    var found = Walk(0.0, false, here.inside && here.gap > 0.0);
    // Fine steps to go: none while steps are coarse.
    var to_go = 0u;
    for (var i = 0u; i < MAX_WALK_STEPS && found.s < 1.0 && !found.met; i++) {
        let is_coarse = to_go == 0u;
        let next_s = min(found.s + select(fine_step, coarse_step, is_coarse), 1.0);
        let next = look_at(line, next_s, camera, pole);
        let refines = is_coarse && fine_steps > 1u && may_meet(here, next, poles.coarse_px);
        let is_tested = !refines && (!is_coarse || fine_steps == 1u);
        found.met = is_tested && meets(here, next);
        let crossing = found.s + (next_s - found.s) * clamp(here.gap / max(here.gap - next.gap, 1e-9), 0.0, 1.0);
        to_go = select(max(to_go, 1u) - 1u, fine_steps, refines);
        found.free = found.free && (refines || (next.inside && next.gap > 0.0));
        found.s = select(select(next_s, crossing, found.met), found.s, refines);
        here.gap = select(next.gap, here.gap, refines);
        here.footprint = select(next.footprint, here.footprint, refines);
        here.connected = select(next.connected, here.connected, refines);
    }
    found.free = found.free && found.s >= 1.0;
    return found;
}

// A ray in an image, as far as it lies within the depths that the camera sees.
struct Seen { line: Line, near: f32, far: f32, near_w: f32, far_w: f32, whole: bool }

fn seen_by(camera: SampleCamera, pole: Pole, ray: MirroredRay, span: Span) -> Seen {
    let a = homogeneous(camera.homogeneous_pixel_from_world, vec4f(ray.origin_in_world, 1.0));
    let b = homogeneous(camera.homogeneous_pixel_from_world, vec4f(ray.direction, 0.0));
    let inverse = safe_reciprocal(b.z);
    let ends = (1.0 / vec2f(pole.nearest_per_m, pole.farthest_per_m) - a.z) * inverse;
    let near = max(span.near, min(ends.x, ends.y));
    let far = min(span.far, max(ends.x, ends.y));
    let p = a + b * near;
    let q = a + b * max(far, near);
    let origin = vec3f(p.xy, 1.0) / max(p.z, 1e-20);
    let line = Line(origin, vec3f(q.xy, 1.0) / max(q.z, 1e-20) - origin);
    return Seen(line, near, far, p.z, q.z, near <= span.near && far >= span.far);
}

// The nearest end that any image shows.
struct Found { t: f32, place: vec2f, image: u32, met: bool, free: bool }

fn nearer(found: Found, image: u32, ray: MirroredRay, span: Span) -> Found {
    let camera = work.cameras[image];
    let pole = poles.cameras[image];
    let seen = seen_by(camera, pole, ray, Span(span.near, min(span.far, found.t)));
    var nearer = found;
    // A loop that no ray enters costs nothing, unlike a branch.
    for (var walks = seen.near < seen.far; walks; walks = false) {
        let ended = walk(seen.line, camera, pole);
        // Back to the ray's own parameter: 1/w is linear in s.
        let share = ended.s * seen.near_w / ((1.0 - ended.s) * seen.far_w + ended.s * seen.near_w);
        let at = seen.line.origin + seen.line.line * ended.s;
        nearer.t = select(found.t, seen.near + (seen.far - seen.near) * share, ended.met);
        nearer.place = select(found.place, moved(pole, at.xy, at.z) - 0.5, ended.met);
        nearer.image = select(found.image, image, ended.met);
        nearer.met = found.met || ended.met;
        nearer.free = found.free || (ended.free && seen.whole);
    }
    return nearer;
}

// Of the surface, or of the nearest sample where none goes on there.
fn color_at(camera: SampleCamera, place: vec2f) -> vec3f {
    let clamped = clamp(place, vec2f(0.0), camera.cells - CELL_MARGIN_PX);
    let cell = vec2u(clamped);
    let cell_index = camera.first_cell + cell.y * camera.width_px + cell.x;
    let within = clamped - floor(clamped);
    let smooth_at = select(round(within), within, corners_of(cell_index).connected);
    let shares = bilinear_shares(smooth_at);
    let colors = colors_of(cell_index).corners;
    return shares.x * colors[0] + shares.y * colors[1] + shares.z * colors[2] + shares.w * colors[3];
}

@compute @workgroup_size(LIST_WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= lists[work.view.number].count { return; }
    let index = listed_pixels[first_listed() + id.x];
    let ray = rays[index];
    let span = span_in_volume(ray.origin_in_world, ray.direction, ray.near_m);
    var found = Found(FAR_AWAY, vec2f(0.0), 0u, false, span.near >= span.far);
    for (var image = 0u; image < {{ cameras }}u; image++) { found = nearer(found, image, ray, span); }
    let camera = work.cameras[found.image];
{% if count_fetches %}
    let steps = fetches;
{% endif %}
    let color = color_at(camera, found.place);
{% if count_fetches %}
    fetches = steps;
{% endif %}
    write_found(index, found.met, found.t, color, origin_of(camera.mask, 0u), found.free && !found.met);
}
