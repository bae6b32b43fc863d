// Makes each sample of an image a quad of its texel (Xie et al., Algorithm 4). A corner is what the corner image holds,
// the same for all quads around it. Where a discontinuity lies between corner and sample, it is where the corner's ray
// meets the sample's own plane.
{% include "normal.wgsl" %}
{% include "cut.wgsl" %}

// For each texel corner: the inverse depth and normal of the sample to its lower right, and its own inverse depth.
@group(0) var planes: texture_2d<u32>;
// For each sample its corners: upper left, upper right, lower left, lower right.
@group(0) var<storage, read_write> inverse_depths: array<vec4f>;
@group(0) var<storage, read_write> extents: array<u32>;

const HALF_DIAGONAL_PX: f32 = 0.70710678;

struct Sample { inverse_depth: f32, ray: vec3f, normal: vec3f, tame_normal: vec3f }

fn plane_texel(at: vec2u) -> vec4u {
    return textureLoad(planes, texel_at(work.first_corner + at.y * (work.size_px.x + 1u) + at.x), 0);
}

// Faces the eye, by at least as much as a surface of the greatest slope.
fn tamed(normal: vec3f, ray: vec3f) -> vec3f {
    let towards = normalize(ray);
    let facing = select(normal, -normal, dot(normal, towards) > 0.0);
    let cosine = -dot(facing, towards);
    let sideways = facing + towards * cosine;
    let least_cosine = inverseSqrt(1.0 + GREATEST_SLOPE * GREATEST_SLOPE);
    let tilted = sideways * (GREATEST_SLOPE / max(length(sideways), 1e-6)) - towards;
    return select(facing, tilted * least_cosine, cosine < least_cosine);
}

// Where a plane through the sample meets another ray.
fn on_plane(sample: Sample, normal: vec3f, ray: vec3f) -> f32 {
    let along = dot(normal, sample.ray);
    return sample.inverse_depth * dot(normal, ray) / select(along, 1e-12, abs(along) < 1e-12);
}

fn is_shared(sample: Sample, held: f32, ray: vec3f) -> bool {
    let slack = FLAT_FOOTPRINTS * max(held, sample.inverse_depth) / work.focal_px;
    let expected = on_plane(sample, sample.normal, ray);
    let close = abs(held - sample.inverse_depth) <= slack;
    let sloped = abs(held - expected) <= max(slack, SLOPE_SHARE * abs(expected - sample.inverse_depth));
    return held > 0.0 && (close || sloped);
}

// On the sample's own plane, but no farther off than half a texel's diagonal on the greatest slope, nor than the half or
// double depth. Where the corner's ray is known to go past the surface, its silhouette lies before the corner. A steep
// plane would stand out there like a flap.
fn guessed(sample: Sample, held: f32, ray: vec3f) -> f32 {
    let guess = on_plane(sample, sample.tame_normal, ray);
    let is_silhouette = held >= 0.0 && held < guess;
    let footprints = select(HALF_DIAGONAL_PX * GREATEST_SLOPE, FLAT_FOOTPRINTS, is_silhouette);
    let reach = sample.inverse_depth * min(footprints / work.focal_px, 0.5);
    return clamp(guess, sample.inverse_depth - reach, sample.inverse_depth + reach);
}

fn corner(sample: Sample, at: vec2u) -> f32 {
    let held = bitcast<f32>(plane_texel(at).z);
    let ray = ray_at(vec2f(at));
    return select(guessed(sample, held, ray), held, is_shared(sample, held, ray));
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= work.size_px) { return; }
    let index = id.y * work.size_px.x + id.x;
    let texel = plane_texel(id.xy);
    let inverse_depth = bitcast<f32>(texel.x);
    let ray = ray_at(vec2f(id.xy) + 0.5);
    let normal = unit_from_oct16(texel.y);
    let sample = Sample(inverse_depth, ray, normal, tamed(normal, ray));
    inverse_depths[index] = vec4f(
        corner(sample, id.xy), corner(sample, id.xy + vec2u(1u, 0u)),
        corner(sample, id.xy + vec2u(0u, 1u)), corner(sample, id.xy + 1u),
    );
    extents[index] = select(0u, word_of(vec2u(1u)), inverse_depth > 0.0);
}
