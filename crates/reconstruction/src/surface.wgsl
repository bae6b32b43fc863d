// The vote of all cameras on a point: the surfaces that their samples describe around it.
{% include "color.wgsl" %}
{% include "view_work.wgsl" %}
{% include "cell.wgsl" %}

// RGB9E5 of each texel and of the one below it: half the bytes of all four corners of each cell.
@group(0) var cell_colors: texture_2d<u32>;
{% include "found.wgsl" %}

// A silhouette runs through a cell that is not connected: what is nearer counts until the cameras vote. Before the
// background all is free, however far beyond the samples of its image.
fn surface_code(corners: Corners, at: vec2f) -> f32 {
    let nearest = max(max(corners.codes.x, corners.codes.y), max(corners.codes.z, corners.codes.w));
    let code = select(nearest, bilinear(corners.codes, at), corners.connected);
    return select(code, -FAR_AWAY, code < FIRST_SAMPLE);
}

{% include "colors.wgsl" %}

{% if holes %}
fn faded(share: f32) -> f32 { return clamp((share - LEAST_SHARE) / (1.0 - LEAST_SHARE), 0.0, 1.0); }
{% endif %}

// A camera's vote on a point: the weight and the place of its colour, and shares of the texels around. `same` lies on the
// point's own surface, `beyond` shows what is beyond it.
struct CameraVote { weight: f32, cell: u32, shares: vec4f, same: f32, beyond: f32 }

fn vote_of(camera: SampleCamera, point_in_world: vec3f, view_direction: vec3f) -> CameraVote {
    let p = homogeneous(camera.homogeneous_pixel_from_world, vec4f(point_in_world, 1.0));
    let cells = camera.cells;
    let inverse_w = 1.0 / p.z;
    let uv = p.xy * inverse_w - 0.5;
    let inside = p.z > 0.0 && all(uv >= vec2f(0.0)) && all(uv < cells);
    let clamped = clamp(uv, vec2f(0.0), cells - CELL_MARGIN_PX);
    let cell = vec2u(clamped);
    let at = clamped - floor(clamped);
    let cell_index = camera.first_cell + cell.y * camera.width_px + cell.x;
    let corners = corners_of(cell_index);
    let code_above = camera.code_scale * inverse_w;
    let code = code_above + camera.code_offset;
    let reach = THICKNESS_FOOTPRINTS * code_above / camera.focal_px;
    // In a connected cell the surface itself counts, else each sample for itself.
    let gaps = code - select(corners.codes, vec4f(bilinear(corners.codes, at)), corners.connected);
    let share = bilinear_shares(at);
    let is_sample = corners.codes > vec4f(FIRST_SAMPLE);
    let shares = select(vec4f(0.0), share, (abs(gaps) < vec4f(reach)) & is_sample);
    let same = dot(shares, vec4f(1.0));
{% if holes %}
    // A texel whose way is not proven free proves nothing of the space before it.
    let proven = share * select(0.0, 1.0, corners.certain);
{% else %}
    let proven = share;
{% endif %}
    let beyond = dot(select(vec4f(0.0), proven, ((gaps > vec4f(reach)) | !is_sample) & (corners.codes > vec4f(0.5))), vec4f(1.0));
    // Angle between the two lines of sight, footprint and distance to the border.
    let eye_to_point = point_in_world - camera.eye_in_world;
    let inverse_distance = inverseSqrt(dot(eye_to_point, eye_to_point));
    let off = eye_to_point * inverse_distance - view_direction;
    let border = min(min(min(uv.x, cells.x - uv.x), min(uv.y, cells.y - uv.y)) / BORDER_PX, 1.0) + 1e-3;
    let footprint = camera.focal_px * inverse_distance;
    let weight = border * footprint * footprint / (dot(off, off) + ANGLE_FLOOR);
{% if holes %}
    // Weight fades towards omitted texels: it goes over to the image that holds them, without a seam. A sample close
    // behind an omitted surface is not that surface: it counts where nothing else does.
    let own = shares * mix(vec4f(HIDDEN_WEIGHT), vec4f(1.0), corners.proven);
    let fade = faded(dot(shares, corners.proven)) + HIDDEN_WEIGHT * faded(same);
{% else %}
    let fade = 1.0;
{% endif %}
    return CameraVote(select(0.0, weight * fade, inside && same > LEAST_SHARE), cell_index, {{ "own" if holes else "shares" }}, select(0.0, same, inside), select(0.0, beyond, inside));
}

// `occupied`: the cameras together hold that there is a surface. A silhouette lies somewhere within
// a texel; the mean of what all cameras show around a point tells better where than any one does.
// `origin`: a hit's provenance but for its kind; 0 where no camera shows the point.
struct Blend { color_linear: vec3f, origin: u32, occupied: bool }

fn color_of(vote: CameraVote) -> vec3f {
    let color = mixed_color(vote.cell, vote.shares);
{% if holes %}
    return color / max(dot(vote.shares, vec4f(1.0)), 1e-6);
{% else %}
    return color / max(vote.same, LEAST_SHARE);
{% endif %}
}

// The two cameras that know a point best, each weighted by how far it surpasses the third (Buehler et al. 2001, with
// k = 2). No seam shows where cameras change places. The order of cameras does not matter.
fn blend_two_best(point_in_world: vec3f, direction: vec3f) -> Blend {
    let view_direction = normalize(direction);
    var first = vote_of(work.cameras[0], point_in_world, view_direction);
    var first_mask = work.cameras[0].mask;
    var same = first.same;
    var beyond = first.beyond;
    var carved = first.beyond > CARVING_SHARE;
    var second = CameraVote(0.0, 0u, vec4f(0.0), 0.0, 0.0);
    var second_mask = 0u;
    var third_weight = 0.0;
{% for k in range(1, cameras) %}
    {
        let vote = vote_of(work.cameras[{{ k }}], point_in_world, view_direction);
        let mask = work.cameras[{{ k }}].mask;
        same += vote.same;
        beyond += vote.beyond;
        carved = carved || vote.beyond > CARVING_SHARE;
        let best = vote.weight > first.weight;
        let better = vote.weight > second.weight;
        third_weight = max(third_weight, min(vote.weight, second.weight));
        second = pick_vote(pick_vote(second, vote, better), first, best);
        second_mask = select(select(second_mask, mask, better), first_mask, best);
        first = pick_vote(first, vote, best);
        first_mask = select(first_mask, mask, best);
    }
{% endfor %}
    let weights = max(vec2f(first.weight, second.weight) - third_weight, vec2f(0.0)) + vec2f(1e-9, 0.0);
    let color = (color_of(first) * weights.x + color_of(second) * weights.y) / (weights.x + weights.y);
    let mask = select(0u, first_mask, first.weight > 0.0) | select(0u, second_mask, second.weight > third_weight);
    return Blend(color, origin_of(mask, split_of(first, first_mask, second, mask, weights)), same >= beyond && mask != 0u && !carved);
}

// How the cameras of `mask` share a colour: 1 + 254 times the share of the one with the lowest bit; 0 where a texel around the
// point lies on another surface.
fn split_of(first: CameraVote, first_mask: u32, second: CameraVote, mask: u32, weights: vec2f) -> u32 {
    let own = vec2f(dot(first.shares, vec4f(1.0)), dot(second.shares, vec4f(1.0)));
    let is_whole = own.x > WHOLE && (own.y > WHOLE || mask == first_mask);
    let share = weights.x / (weights.x + weights.y);
    let is_lowest = (mask & (first_mask - 1u)) == 0u;
    let split = 1u + u32(254.0 * select(1.0 - share, share, is_lowest) + 0.5);
    return select(0u, split, is_whole);
}

fn pick_vote(a: CameraVote, b: CameraVote, second: bool) -> CameraVote {
    return CameraVote(
        select(a.weight, b.weight, second), select(a.cell, b.cell, second), select(a.shares, b.shares, second),
        select(a.same, b.same, second), 0.0,
    );
}
