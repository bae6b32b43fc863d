// Mirrored rays in images of single-pole cameras, where they are curves: the walk of Rosen et al., section 3.2, in coarse steps,
// and in fine ones where a coarse step may meet the surface.
{% include "surface.wgsl" %}
{% include "pixel_list.wgsl" %}
{% include "bounce/ray.wgsl" %}
{% include "single_pole.wgsl" %}
@group(0) var<storage, read> rays: array<MirroredRay>;

// Linear along a ray: columns and rows before they move, and inverse depth.
struct Line { origin: vec3f, line: vec3f }

// The image at a place of a line. `gap`, in codes, is positive before the surface, and FAR_AWAY where there is none.
struct Look { place: vec2f, gap: f32, footprint: f32, connected: bool }

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
    return Look(place, select(FAR_AWAY, gap, inside && surface >= FIRST_SAMPLE), code_above / camera.focal_px, inside && corners.connected);
}

// A coarse step does not meet the surface where both of its ends are well before it, or well behind it: as far as a surface
// that rises by a footprint in a texel may come near from the nearer end.
fn may_meet(a: Look, b: Look, coarse_px: f32) -> bool {
    let fuzzy = 0.5 * coarse_px * max(a.footprint, b.footprint);
    return min(a.gap, b.gap) <= fuzzy && max(a.gap, b.gap) >= -fuzzy;
}

// A fine step meets a surface that goes on from end to end, or one whose sample it ends close behind. Around the pole a step may
// leap from one side to the other.
fn meets(a: Look, b: Look, fine_px: f32) -> bool {
    let close = b.gap >= -THICKNESS_FOOTPRINTS * b.footprint;
    let goes_on = a.connected && b.connected && distance(a.place, b.place) <= LONGEST_STEP * fine_px;
    return a.gap > 0.0 && b.gap <= 0.0 && (close || goes_on);
}

struct Walk { s: f32, met: bool }

fn walk(line: Line, camera: SampleCamera, pole: Pole) -> Walk {
    var here = look_at(line, 0.0, camera, pole);
    let end = line.origin + line.line;
    let chord_px = max(distance(here.place, moved(pole, end.xy, end.z) - 0.5), length(line.line.xy));
    let coarse_step = min(poles.coarse_px / max(chord_px, 1e-3), 1.0);
    let fine_steps = u32(ceil(poles.coarse_px / poles.fine_px));
    let fine_px = poles.coarse_px / f32(fine_steps);
    let fine_step = coarse_step / f32(fine_steps);
    var found = Walk(0.0, false);
    // Fine steps to go: none while steps are coarse.
    var to_go = 0u;
    for (var i = 0u; i < MAX_WALK_STEPS && found.s < 1.0 && !found.met; i++) {
        let is_coarse = to_go == 0u;
        let next_s = min(found.s + select(fine_step, coarse_step, is_coarse), 1.0);
        let next = look_at(line, next_s, camera, pole);
        let refines = is_coarse && fine_steps > 1u && may_meet(here, next, poles.coarse_px);
        let is_tested = !refines && (!is_coarse || fine_steps == 1u);
        found.met = is_tested && meets(here, next, fine_px);
        let crossing = found.s + (next_s - found.s) * clamp(here.gap / max(here.gap - next.gap, 1e-9), 0.0, 1.0);
        to_go = select(max(to_go, 1u) - 1u, fine_steps, refines);
        found.s = select(select(next_s, crossing, found.met), found.s, refines);
        here.place = select(next.place, here.place, refines);
        here.gap = select(next.gap, here.gap, refines);
        here.footprint = select(next.footprint, here.footprint, refines);
        here.connected = select(next.connected, here.connected, refines);
    }
    return found;
}

// A ray in an image, as far as it lies within the depths that the camera sees and before the image. The pole lies in the image,
// so that nothing moves into it.
struct Seen { line: Line, near: f32, far: f32, near_w: f32, far_w: f32 }

fn seen_by(camera: SampleCamera, pole: Pole, ray: MirroredRay, span: Span) -> Seen {
    let a = homogeneous(camera.homogeneous_pixel_from_world, vec4f(ray.origin_in_world, 1.0));
    let b = homogeneous(camera.homogeneous_pixel_from_world, vec4f(ray.direction, 0.0));
    // The depth, and the homogeneous distances from the four borders, change by `by` along the ray; none may be negative.
    let size_px = camera.cells + 1.0;
    let depths = vec2f(a.z - 1.0 / pole.nearest_per_m, 1.0 / pole.farthest_per_m - a.z);
    var within = Span(span.near, span.far);
    within = cut(within, depths.x, b.z);
    within = cut(within, depths.y, -b.z);
    within = cut(within, a.x, b.x);
    within = cut(within, a.y, b.y);
    within = cut(within, size_px.x * a.z - a.x, size_px.x * b.z - b.x);
    within = cut(within, size_px.y * a.z - a.y, size_px.y * b.z - b.y);
    let p = a + b * within.near;
    let q = a + b * max(within.far, within.near);
    let origin = vec3f(p.xy, 1.0) / max(p.z, 1e-20);
    let line = Line(origin, vec3f(q.xy, 1.0) / max(q.z, 1e-20) - origin);
    return Seen(line, within.near, within.far, p.z, q.z);
}

// The part of a span in which `start + by · t` is not negative.
fn cut(span: Span, start: f32, by: f32) -> Span {
    let t = -start * safe_reciprocal(by);
    return Span(select(span.near, max(span.near, t), by > 0.0), select(min(span.far, t), span.far, by > 0.0));
}

// The nearest end that any image shows.
struct Found { t: f32, place: vec2f, image: u32, met: bool }

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
    return mixed_color(cell_index, bilinear_shares(smooth_at));
}

@compute @workgroup_size(LIST_WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= lists[work.view.number].count { return; }
    let index = listed_pixels[first_listed() + id.x];
    let ray = rays[index];
    let span = span_in_volume(ray.origin_in_world, ray.direction, ray.near_m);
    var found = Found(FAR_AWAY, vec2f(0.0), 0u, false);
    for (var image = 0u; image < {{ cameras }}u; image++) { found = nearer(found, image, ray, span); }
    let camera = work.cameras[found.image];
    let color = color_at(camera, found.place);
    // Coarse steps prove nothing to be free: only what never comes into the volume meets nothing for certain.
    write_found(index, found.met, found.t, color, origin_of(camera.mask, 0u), span.near >= span.far);
}
