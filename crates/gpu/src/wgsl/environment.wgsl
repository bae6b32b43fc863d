// Light of an environment map; the twin of depth-image's environment_map.rs and environment_light.rs. The includer
// includes color.wgsl and table.wgsl.

// RGB9E5 of the map, row by row.
@group(0) var environment_texels: texture_2d<u32>;
// Means of radiance, lobe after lobe, row by row.
@group(0) var environment_lobes: texture_2d<f32>;
// A header, then a texel for each bright one: cumulated share, place, chroma.
@group(0) var bright_texels: texture_2d<u32>;

const ENVIRONMENT_PI: f32 = 3.1415927;
const LOBE_SIZE_PX: vec2u = vec2u({{ lobe_size_px[0] }}u, {{ lobe_size_px[1] }}u);
const DIFFUSE_LOBE: u32 = {{ lobe_roughness | length }}u;
const DIFFUSE_BASE_LOBE: u32 = {{ lobe_roughness | length + 1 }}u;

// What is the same for all of a map's texels.
struct EnvironmentHeader { bright_count: u32, bright_irradiance: f32, base_limit: f32, size_px: vec2u }

fn environment_header() -> EnvironmentHeader {
    let words = textureLoad(bright_texels, vec2u(0u), 0);
    return EnvironmentHeader(words.x, bitcast<f32>(words.y), bitcast<f32>(words.z), vec2u(words.w & 0xffffu, words.w >> 16u));
}

// The place of a direction in a map, in shares of its width and height.
fn environment_share(towards: vec3f) -> vec2f {
    // Straight up and down have no east.
    let north = select(-towards.z, 1e-20, abs(towards.z) < 1e-20);
    return vec2f(0.5 + atan2(towards.x, north) * (0.5 / ENVIRONMENT_PI), acos(clamp(towards.y, -1.0, 1.0)) / ENVIRONMENT_PI);
}

fn environment_direction(share: vec2f) -> vec3f {
    let east = 2.0 * ENVIRONMENT_PI * (share.x - 0.5);
    let down = ENVIRONMENT_PI * share.y;
    return vec3f(sin(east) * sin(down), cos(down), -cos(east) * sin(down));
}

// The four texels around a place, and where it lies between them. Rows wrap around; columns end at the poles.
struct Around { columns: vec2u, rows: vec2u, at: vec2f }

fn texels_around(share: vec2f, size_px: vec2u) -> Around {
    let place = share * vec2f(size_px) - 0.5;
    let first = vec2i(floor(place));
    let size = vec2i(size_px);
    let columns = (vec2i(first.x, first.x + 1) + size.x) % size.x;
    let rows = clamp(vec2i(first.y, first.y + 1), vec2i(0), vec2i(size.y - 1));
    return Around(vec2u(columns), vec2u(rows), place - floor(place));
}

fn environment_texel(place: vec2u, width_px: u32) -> vec3f {
    return linear_from_rgb9e5(textureLoad(environment_texels, texel_at(place.y * width_px + place.x), 0).x);
}

// Radiance from a direction, a unit vector. It is the background, too.
fn environment_radiance(towards: vec3f) -> vec3f {
    let size_px = environment_header().size_px;
    let near = texels_around(environment_share(towards), size_px);
    let upper = mix(
        environment_texel(vec2u(near.columns.x, near.rows.x), size_px.x),
        environment_texel(vec2u(near.columns.y, near.rows.x), size_px.x), near.at.x,
    );
    let lower = mix(
        environment_texel(vec2u(near.columns.x, near.rows.y), size_px.x),
        environment_texel(vec2u(near.columns.y, near.rows.y), size_px.x), near.at.x,
    );
    return mix(upper, lower, near.at.y);
}

fn lobe_texel(lobe: u32, column: u32, row: u32) -> vec3f {
    return textureLoad(environment_lobes, texel_at((lobe * LOBE_SIZE_PX.y + row) * LOBE_SIZE_PX.x + column), 0).rgb;
}

// The mean over a lobe around a direction.
fn environment_lobe(lobe: u32, middle: vec3f) -> vec3f {
    let near = texels_around(environment_share(middle), LOBE_SIZE_PX);
    let upper = mix(lobe_texel(lobe, near.columns.x, near.rows.x), lobe_texel(lobe, near.columns.y, near.rows.x), near.at.x);
    let lower = mix(lobe_texel(lobe, near.columns.x, near.rows.y), lobe_texel(lobe, near.columns.y, near.rows.y), near.at.x);
    return mix(upper, lower, near.at.y);
}

// The radiance that a white surface reflects, unoccluded.
fn environment_diffuse(normal: vec3f) -> vec3f {
    return environment_lobe(DIFFUSE_LOBE, normal);
}

// The map as a surface mirrors it: between the means of the two lobes that its roughness lies between.
fn environment_mirrored(mirrored: vec3f, roughness: f32) -> vec3f {
    var means = array<f32, {{ lobe_roughness | length + 1 }}>(0.0{% for rough in lobe_roughness %}, {{ rough }}{% endfor %});
    var level = 0u;
    for (var i = 1u; i < {{ lobe_roughness | length }}u; i++) { level = select(level, i, roughness > means[i]); }
    let rough = environment_lobe(level, mirrored);
    var smooth_linear = vec3f(0.0);
    if level == 0u {
        smooth_linear = environment_radiance(mirrored);
    } else {
        smooth_linear = environment_lobe(level - 1u, mirrored);
    }
    return mix(smooth_linear, rough, clamp((roughness - means[level]) / (means[level + 1u] - means[level]), 0.0, 1.0));
}

// Radiance without what bright texels have above the limit.
fn environment_base(towards: vec3f) -> vec3f {
    let header = environment_header();
    let place = min(vec2u(environment_share(towards) * vec2f(header.size_px)), header.size_px - 1u);
    let radiance = environment_texel(place, header.size_px.x);
    return radiance * min(header.base_limit / max(dot(radiance, vec3f(0.2126, 0.7152, 0.0722)), 1e-9), 1.0);
}

// The radiance that a white surface reflects of it, unoccluded.
fn environment_base_diffuse(normal: vec3f) -> vec3f {
    return environment_lobe(DIFFUSE_BASE_LOBE, normal);
}

fn has_bright_texels() -> bool { return environment_header().bright_count > 0u; }

// A direction, and the irradiance of all bright texels on a surface that faces it.
struct Bright { towards: vec3f, irradiance_linear: vec3f }

// One point of the bright texels; the mean over `place` in the unit square is all of them.
fn bright_from(place: vec2f) -> Bright {
    let header = environment_header();
    var first = 1u;
    var last = header.bright_count;
    // The first whose cumulated share is above the place.
    while first < last {
        let middle = (first + last) / 2u;
        let is_beyond = bitcast<f32>(textureLoad(bright_texels, texel_at(middle), 0).x) <= place.x;
        first = select(first, middle + 1u, is_beyond);
        last = select(middle, last, is_beyond);
    }
    let words = textureLoad(bright_texels, texel_at(first), 0);
    let before = select(0.0, bitcast<f32>(textureLoad(bright_texels, texel_at(first - 1u), 0).x), first > 1u);
    let along = clamp((place.x - before) / max(bitcast<f32>(words.x) - before, 1e-9), 0.0, 1.0);
    // Equal steps of the height's cosine are equal solid angles.
    let size = vec2f(header.size_px);
    let row = f32(words.y >> 16u);
    let edges = cos(ENVIRONMENT_PI * vec2f(row, row + 1.0) / size.y);
    let down = acos(clamp(mix(edges.x, edges.y, place.y), -1.0, 1.0)) / ENVIRONMENT_PI;
    let towards = environment_direction(vec2f((f32(words.y & 0xffffu) + along) / size.x, down));
    return Bright(towards, linear_from_rgb9e5(words.z) * header.bright_irradiance);
}
