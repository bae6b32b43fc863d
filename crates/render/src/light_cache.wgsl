// Light of samples at the surfaces of a view. Each surface is projected into each sample image; of the four texels around
// its place those count that lie on the same surface. What they say is averaged, and written as if rays had brought it.
// Pixels that no image knows well enough are listed, to be lit by rays of their own. The twin is scalar/light_cache.rs.
{% include "camera.wgsl" %}
{% include "color.wgsl" %}
{% include "normal.wgsl" %}
{% include "albedo.wgsl" %}
{% include "table.wgsl" %}
{% include "light.wgsl" %}
{% include "surfaces.wgsl" %}
{% include "lamp_shares.wgsl" %}

// A sample image.
struct CacheCamera {
    // Takes a place, from the view's eye, to (column · w, row · w, w); w is planar depth.
    homogeneous_texel_from_offset: array<vec4f, 3>,
    // From the view's eye.
    eye_offset: vec3f,
    // A texel's side on a surface that faces the camera, in metres at a depth of one metre.
    footprint: f32,
    // World direction of a texel = column · x + row · y + corner; its parameter is planar depth in metres.
    column_in_world: vec3f,
    // The number of its first sample in the table.
    first_sample: u32,
    row_in_world: vec3f,
    // Half a step of the stored inverse depth.
    half_step_per_m: f32,
    corner_in_world: vec3f,
    near_m: f32,
    size_px: vec2u,
}

struct Cache {
    shares: LampShares,
    // The coverage by one image's texels from which light is known.
    least_coverage: f32,
    // From the plane of a texel's triangle, at most.
    plane_footprints: f32,
    // Between normals of triangles, at least.
    least_cosine: f32,
    // Between the luminances of texels, at most, relative to the greatest.
    most_difference: f32,
    camera_count: u32,
    cameras: array<CacheCamera, MAX_CACHE_CAMERAS>,
}

@group(0) var<uniform> illumination: Illumination;
@group(0) var<uniform> cache: Cache;
// Texels of a sample: inverse depth, the normals of its triangle and of shading, light of lamps; light of the environment, and
// packed shares.
@group(0) var samples: texture_2d<u32>;
// Of the view.
@group(0) var triangle_normals: texture_2d<u32>;
@group(0) var<storage, read_write> sums: array<f32>;
struct List { workgroups: atomic<u32>, y: u32, z: u32, count: atomic<u32> }
@group(0) var<storage, read_write> listed_pixels: array<u32>;
@group(0) var<storage, read_write> list: List;
{%- if provenance_plane %}
@group(0) var<storage, read_write> words: array<u32>;
{%- endif %}
{% include "sums.wgsl" %}

// Texels of a sample in the table.
const SAMPLE_TEXELS: u32 = {{ sample_texels }}u;
// Texels near the border of an image count less, within this distance.
const BORDER_PX: f32 = 2.0;
const GRAZING_SHARE: f32 = 0.02;
// Texels of less weight among the four around a place do not have to agree.
const LEAST_WEIGHT: f32 = 0.02;
// Differences are relative to no less light than this.
const LEAST_LUMINANCE: f32 = 0.05;
const MOST_RATIO: f32 = 4.0;
// Cosine between normals of shading up to which the light is the same.
const SAME_NORMAL: f32 = 0.99999;

struct Point {
    // From the view's eye.
    offset: vec3f,
    normal: vec3f,
    triangle_normal: vec3f,
    footprint_m: f32,
}

// Light of one image, or of all of them: sums over texels by their weights.
struct CachedLight {
    lamps_linear: vec3f,
    environment_linear: vec3f,
    weight: f32,
{%- for word in range(share_words) %}
    shares{{ word }}: vec4f,
{%- endfor %}
}

struct Known {
    light: CachedLight,
    // The greatest of any image: the sum of the bilinear weights of the texels that count.
    coverage: f32,
    least_luminance: f32,
    greatest_luminance: f32,
    camera_mask: u32,
}

fn luminance(linear: vec3f) -> f32 { return dot(linear, vec3f(0.2126, 0.7152, 0.0722)); }
{% if lamp_vectors %}

// The luminance of each lamp that has a share times the direction towards it, then of all other lamps together, then of the
// bright texels of an environment map.
var<private> lamp_vectors: array<vec3f, {{ lamp_vectors }}>;

fn find_lamps(point_in_world: vec3f) {
    for (var i = 0u; i < {{ lamp_vectors }}u; i++) { lamp_vectors[i] = vec3f(0.0); }
{%- if light_count %}
    for (var number = 0u; number < illumination.light_count; number++) {
        let incident = incident_from(illumination.lights[number], point_in_world, vec2f(0.5));
        var place = number;
{%- if light_count > max_lamp_shares %}
        place = MAX_LAMP_SHARES;
        for (var named = 0u; named < MAX_LAMP_SHARES; named++) {
            place = select(place, named, cache.shares.lamps[named / 4u][named % 4u] == number);
        }
{%- endif %}
        lamp_vectors[place] += incident.towards * luminance(incident.irradiance_linear);
    }
{%- endif %}
{%- if bright_traced %}
    for (var bright = has_bright_texels(); bright; bright = false) {
        let incident = incident_from_bright(vec2f(0.5));
        lamp_vectors[{{ lamp_vectors - 1 }}u] = incident.towards * luminance(incident.irradiance_linear);
    }
{%- endif %}
}
{% endif %}

// The light that lamps with these shares would bring to a surface.
fn expected_of_lamps(normal: vec3f{% for word in range(share_words) %}, shares{{ word }}: vec4f{% endfor %}) -> f32 {
    var expected = 0.0;
{%- for place in range(lamp_vectors) %}
{%- set byte = place + 1 %}
    expected += max(dot(lamp_vectors[{{ place }}u], normal), 0.0){% if share_words and place < lamps_with_shares %} * shares{{ byte // 4 }}[{{ byte % 4 }}u]{% endif %};
{%- endfor %}
    return expected;
}

fn expected_of_environment(normal: vec3f) -> f32 {
    return luminance({{ "environment_base_diffuse" if bright_traced else "environment_diffuse" }}(normal));
}

fn ratio_of(here: f32, there: f32) -> f32 { return clamp(here / max(there, 1e-6), 0.0, MOST_RATIO); }

// What the four texels around a point's place in an image say of it.
fn consult(image: CacheCamera, number: u32, point: Point, known: ptr<function, Known>) {
    let at = vec4f(point.offset, 1.0);
    let rows = image.homogeneous_texel_from_offset;
    let depth_m = dot(rows[2], at);
    let place = vec2f(dot(rows[0], at), dot(rows[1], at)) / depth_m;
    let size = vec2f(image.size_px);
    let from_border = min(place, size - place);
    let border = clamp(min(from_border.x, from_border.y) / BORDER_PX, 0.0, 1.0);
    let towards_camera = image.eye_offset - point.offset;
    // Loops, not branches: the software device skips only loops that no lane needs.
    for (var inside = depth_m > image.near_m && border > 0.0; inside; inside = false) {
        let low = vec2i(floor(place - 0.5));
        let share = place - 0.5 - vec2f(low);
        let facing = max(dot(point.triangle_normal, towards_camera), 0.0) * inverseSqrt(max(dot(towards_camera, towards_camera), 1e-30));
        let texel_m = depth_m * image.footprint;
        let closeness = border * (facing + GRAZING_SHARE) / (texel_m * texel_m);
        let most_m = cache.plane_footprints * max(texel_m, point.footprint_m) + image.half_step_per_m * depth_m * depth_m;
        var own: CachedLight;
        var coverage = 0.0;
        for (var corner = 0u; corner < 4u; corner++) {
            let step = vec2i(i32(corner & 1u), i32(corner >> 1u));
            let texel = low + step;
            let weights = select(1.0 - share, share, step == vec2i(1));
            let weight = weights.x * weights.y;
            let is_inside = all(texel >= vec2i(0)) && all(texel < vec2i(image.size_px));
            for (var near = is_inside && weight > 0.0; near; near = false) {
                let first = (image.first_sample + u32(texel.y) * image.size_px.x + u32(texel.x)) * SAMPLE_TEXELS;
                let words = textureLoad(samples, texel_at(first), 0);
                let inverse_depth_per_m = bitcast<f32>(words.x);
                let normal = unit_from_oct16(words.y);
                let center = vec2f(texel) + 0.5;
                let direction = image.column_in_world * center.x + image.row_in_world * center.y + image.corner_in_world;
                let between = point.offset - image.eye_offset - direction / max(inverse_depth_per_m, 1e-30);
                let planes_m = max(abs(dot(between, normal)), abs(dot(between, point.triangle_normal)));
                let is_same = dot(normal, point.triangle_normal) >= cache.least_cosine && planes_m <= most_m;
                for (var counts = inverse_depth_per_m > 0.0 && is_same; counts; counts = false) {
                    coverage += weight;
                    add_texel(words, first, weight, closeness, point, &own, known);
                }
            }
        }
        for (var counts = coverage > 0.0; counts; counts = false) {
            add_image(own, coverage * coverage, known);
            (*known).coverage = max((*known).coverage, coverage);
            (*known).camera_mask |= 1u << number;
        }
    }
}

// Adds the light of a texel, as it would be with the point's own normal.
fn add_texel(words: vec4u, first: u32, weight: f32, closeness: f32, point: Point, own: ptr<function, CachedLight>, known: ptr<function, Known>) {
    let more = textureLoad(samples, texel_at(first + 1u), 0);
    var lamps = linear_from_rgb9e5(words.w);
    var environment = linear_from_rgb9e5(more.x);
{%- if share_words > 3 %}
    let rest = textureLoad(samples, texel_at(first + 2u), 0);
{%- endif %}
{%- for word in range(share_words) %}
    let shares{{ word }} = unpack4x8unorm({% if word < 3 %}more[{{ word + 1 }}u]{% else %}rest[{{ word - 3 }}u]{% endif %});
{%- endfor %}
    let normal = unit_from_oct16(words.z);
    for (var differs = dot(normal, point.normal) < SAME_NORMAL; differs; differs = false) {
        lamps *= ratio_of(
            expected_of_lamps(point.normal{% for word in range(share_words) %}, shares{{ word }}{% endfor %}),
            expected_of_lamps(normal{% for word in range(share_words) %}, shares{{ word }}{% endfor %}),
        );
        environment *= ratio_of(expected_of_environment(point.normal), expected_of_environment(normal));
    }
    let total = luminance(lamps + environment);
    let agrees = weight > LEAST_WEIGHT;
    (*known).least_luminance = select((*known).least_luminance, min((*known).least_luminance, total), agrees);
    (*known).greatest_luminance = select((*known).greatest_luminance, max((*known).greatest_luminance, total), agrees);
    let share = weight * closeness;
    (*own).lamps_linear += lamps * share;
    (*own).environment_linear += environment * share;
    (*own).weight += share;
{%- for word in range(share_words) %}
    (*own).shares{{ word }} += shares{{ word }} * share;
{%- endfor %}
}

fn add_image(own: CachedLight, share: f32, known: ptr<function, Known>) {
    (*known).light.lamps_linear += own.lamps_linear * share;
    (*known).light.environment_linear += own.environment_linear * share;
    (*known).light.weight += own.weight * share;
{%- for word in range(share_words) %}
    (*known).light.shares{{ word }} += own.shares{{ word }} * share;
{%- endfor %}
}

fn is_known(known: Known) -> bool {
    let difference = known.greatest_luminance - known.least_luminance;
    let agrees = difference <= cache.most_difference * max(known.greatest_luminance, LEAST_LUMINANCE);
    return known.light.weight > 0.0 && known.coverage >= cache.least_coverage && agrees;
}

fn put(plane: u32, place: u32, value: f32) { sums[camera.first_sum + plane * camera.pixel_count + place] = value; }

// Writes light as the sums of rays.
fn put_light(light: CachedLight, place: u32) {
    let scale = vec2f(f32(camera.shadow_rays_in_sum), f32(camera.occlusion_rays_in_sum)) / light.weight;
    for (var channel = 0u; channel < 3u; channel++) {
        put(LAMPS + channel, place, light.lamps_linear[channel] * scale.x);
        put(ENVIRONMENT + channel, place, light.environment_linear[channel] * scale.y);
    }
{%- if visibility %}
    put(OPEN_TO_ENVIRONMENT, place, light.shares0[0] * scale.y);
{%- for named in range(lamps_with_shares) %}
{%- set byte = named + 1 %}
{%- if named < max_lamp_shares %}
    put(OPEN_TO_LAMPS + {{ ("cache.shares.lamps[" ~ (named // 4) ~ "u][" ~ (named % 4) ~ "u]") if light_count > max_lamp_shares else (named ~ "u") }}, place, light.shares{{ byte // 4 }}[{{ byte % 4 }}u] * scale.x);
{%- endif %}
{%- endfor %}
{%- endif %}
}
{%- if visibility and light_count > max_lamp_shares %}

// Lamps without a share of their own have that of all of them together.
fn put_other_lamps(light: CachedLight, place: u32) {
    let share = light.shares4[0] * f32(camera.shadow_rays_in_sum) / light.weight;
    for (var lamp = 0u; lamp < {{ light_count }}u; lamp++) { put(OPEN_TO_LAMPS + lamp, place, share); }
}
{%- endif %}

fn list_pixel(place: u32) {
    let entry = atomicAdd(&list.count, 1u);
    listed_pixels[entry] = place;
    if entry % LIST_WORKGROUP == 0u { atomicAdd(&list.workgroups, 1u); }
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = pixel_at(id, 1u);
    if is_beyond(pixel) { return; }
    let place = place_of(pixel);
    let depth = reversed_depth_at(pixel);
    let surface = surface_at(pixel);
    let met = depth > 0.0;
    let needs_light = met && (surface.x & SHOWN_AS_IT_IS) == 0u;
    var known: Known;
    known.least_luminance = 3.0e38;
    for (var lit = needs_light; lit; lit = false) {
        let planar_depth_m = camera.near_m / depth;
        let point = Point(
            direction_of(pixel) * planar_depth_m, unit_from_oct16(surface.z),
            unit_from_oct16(textureLoad(triangle_normals, pixel, 0).x), planar_depth_m * camera.footprint,
        );
{%- if lamp_vectors %}
        find_lamps(camera.eye_in_world + point.offset);
{%- endif %}
        for (var number = 0u; number < cache.camera_count; number++) { consult(cache.cameras[number], number, point, &known); }
    }
    let is_answered = needs_light && is_known(known);
    for (var answered = is_answered; answered; answered = false) {
{%- if visibility and light_count > max_lamp_shares %}
        put_other_lamps(known.light, place);
{%- endif %}
        put_light(known.light, place);
    }
    let is_unknown = needs_light && !is_answered;
    if is_unknown { list_pixel(place); }
{%- if provenance_plane %}
    var origin = select(PROVENANCE_EMPTY, PROVENANCE_HIT, met);
    origin = select(origin, PROVENANCE_HIT | known.camera_mask << 8u, is_answered);
    origin = select(origin, PROVENANCE_LIT_HERE, is_unknown);
    words[camera.first_word + {{ provenance_plane }}u * camera.pixel_count + place] = origin;
{%- endif %}
}
