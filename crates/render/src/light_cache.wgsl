// Light of samples at the surfaces of a view. Each surface is projected into each sample image; of the four texels around
// its place those count that lie on the same surface. What they say is averaged, and written as if rays had brought it.
// Pixels that no image knows well enough are listed, to be lit by rays of their own. The twin is scalar/light_cache.rs.
//
// Most points at later positions within their pixels have the light of the first one. They are compared first; the others are listed,
// and looked up in a pass over that list: the software device runs a branch that no lane takes.
{% include "camera.wgsl" %}
{% include "color.wgsl" %}
{% include "normal.wgsl" %}
{% include "albedo.wgsl" %}
{% include "table.wgsl" %}
{% include "light.wgsl" %}
{% include "surfaces.wgsl" %}
{% include "lamp_shares.wgsl" %}
{% include "cached_texels.wgsl" %}

@group(0) var<uniform> illumination: Illumination;
@group(0) var<storage, read_write> sums: array<f32>;
{% include "pixel_list.wgsl" %}
{%- if provenance_plane %}
@group(0) var<storage, read_write> words: array<u32>;
{%- endif %}
{%- if positions == "Asked" %}
// Pixels whose light is looked up.
struct Asked { workgroups: u32, y: u32, z: u32, count: u32, last_count: u32 }
@group(0) var<storage, read> asked_pixels: array<u32>;
@group(0) var<storage, read> asked: Asked;
{%- elif positions != "Only" %}
// The surface of a pixel at its first position: its plane's distance from the eye, the normals of its triangle and of shading, and
// its provenance.
@group(0) var first_surfaces: {{ "texture_storage_2d<rgba32uint, write>" if positions == "First" else "texture_2d<u32>" }};
// 1 for pixels whose sums are still those of the first position.
@group(0) var<storage, read_write> kept: array<u32>;
{%- endif %}
{% include "sums.wgsl" %}

// Texels near the border of an image count less, within this distance.
const BORDER_PX: f32 = 2.0;
const GRAZING_SHARE: f32 = 0.02;
// Texels of less weight among the four around a place do not have to agree.
const LEAST_WEIGHT: f32 = 0.02;
// Differences are relative to no less light than this.
const LEAST_LUMINANCE: f32 = 0.05;
const MOST_RATIO: f32 = 4.0;
{%- if positions == "Later" %}
// Surfaces at two positions within a pixel have one light: cosines between their normals, and the distance from one plane.
const ALIKE_TRIANGLES: f32 = 0.98;
const ALIKE_NORMALS: f32 = 0.9995;
const ALIKE_FOOTPRINTS: f32 = 0.1;
{%- endif %}

// Sums over texels by their weights.
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
{%- if light_count %}

// As incident_from of the lamp's middle, by fewer operations.
fn lamp_vector(light: Light, point_in_world: vec3f) -> vec3f {
    let parallel = light.kind == LIGHT_PARALLEL;
    let middle = light.middle_in_world - select(point_in_world, vec3f(0.0), parallel);
    let distance_m = max(length(middle), LEAST_DISTANCE_M);
    let towards = middle / distance_m;
    let area_normal = cross(light.axis_in_world, light.next_edge_in_world);
    let seen_area = max(-dot(area_normal, towards), 0.0) * (4.0 / LIGHT_PI);
    let cone = clamp((-dot(light.axis_in_world, towards) - light.outer_cosine) * light.cone_scale, 0.0, 1.0);
    let share = select(cone * cone, seen_area, light.kind == LIGHT_RECTANGLE) / (distance_m * distance_m);
    return towards * (luminance(light.color_linear) * select(share, 1.0, parallel));
}
{%- endif %}

fn find_lamps(point_in_world: vec3f) {
{%- for number in range([light_count, max_lamp_shares] | min) %}
    lamp_vectors[{{ number }}u] = lamp_vector(illumination.lights[{{ ("cache.shares.lamps[" ~ (number // 4) ~ "u][" ~ (number % 4) ~ "u]") if light_count > max_lamp_shares else (number ~ "u") }}], point_in_world);
{%- endfor %}
{%- if light_count > max_lamp_shares %}
    var others = vec3f(0.0);
    for (var number = 0u; number < illumination.light_count; number++) {
        others += lamp_vector(illumination.lights[number], point_in_world);
    }
    for (var named = 0u; named < MAX_LAMP_SHARES; named++) { others -= lamp_vectors[named]; }
    lamp_vectors[MAX_LAMP_SHARES] = others;
{%- endif %}
{%- if bright_traced %}
    lamp_vectors[{{ lamp_vectors - 1 }}u] = vec3f(0.0);
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
    expected += max(dot(lamp_vectors[{{ place }}u], normal), 0.0){% if place < lamps_with_shares %} * shares{{ byte // 4 }}[{{ byte % 4 }}u]{% endif %};
{%- endfor %}
    return expected;
}

fn expected_of_environment(normal: vec3f) -> f32 {
    return luminance({{ "environment_base_diffuse" if bright_traced else "environment_diffuse" }}(normal));
}

fn ratio_of(here: f32, there: f32) -> f32 { return clamp(here / max(there, 1e-6), 0.0, MOST_RATIO); }

// What the four texels around a point's place in an image say of it. Branches, and no loops that pass once as elsewhere: most points
// are seen by most images, and the software device keeps in memory what a loop changes.
fn consult(image: CacheCamera, number: u32, point: Point, known: ptr<function, Known>) {
    let at = vec4f(point.offset, 1.0);
    let rows = image.homogeneous_texel_from_offset;
    let depth_m = dot(rows[2], at);
    let place = vec2f(dot(rows[0], at), dot(rows[1], at)) / depth_m;
    let size = vec2f(image.size_px);
    let from_border = min(place, size - place);
    let border = clamp(min(from_border.x, from_border.y) / BORDER_PX, 0.0, 1.0);
    if depth_m > image.near_m && border > 0.0 {
        let low = floor(place - 0.5);
        let share = place - 0.5 - low;
        let center = low + 0.5;
        let offset = point.offset - image.eye_offset;
        let last = size - 1.0;
        // Texels beyond the border have no weight.
        let first_weight = select(vec2f(0.0), 1.0 - share, low >= vec2f(0.0));
        let second_weight = select(vec2f(0.0), share, low < last);
        let first = vec2u(max(low, vec2f(0.0)));
        let second = vec2u(min(low + 1.0, last));
        let upper = (image.first_sample + first.y * image.size_px.x) * SAMPLE_TEXELS;
        let lower = (image.first_sample + second.y * image.size_px.x) * SAMPLE_TEXELS;
        let left = first.x * SAMPLE_TEXELS;
        let right = second.x * SAMPLE_TEXELS;
        let sight = sight_of(image, point, center);
        let texel_m = depth_m * image.footprint;
        let plane_m = cache.tests.plane_footprints * max(texel_m, point.footprint_m);
        let half_step = image.half_step_per_m * depth_m;
        let facing = max(-sight.along_normal, 0.0) * inverseSqrt(max(dot(offset, offset), 1e-30));
        let closeness = border * (facing + GRAZING_SHARE) / (texel_m * texel_m);
        var own: CachedLight;
        var coverage = 0.0;
{%- for corner in range(4) %}
        let texel{{ corner }} = texel_beside(
            sight, {{ "lower" if corner // 2 else "upper" }} + {{ "right" if corner % 2 else "left" }},
            sight.direction{{ " + image.column_in_world" if corner % 2 }}{{ " + image.row_in_world" if corner // 2 }},
            {{ "second" if corner % 2 else "first" }}_weight.x * {{ "second" if corner // 2 else "first" }}_weight.y, point, plane_m, half_step,
        );
        coverage += texel{{ corner }}.weight;
        add_texel(texel{{ corner }}, closeness, point, &own, known);
{%- endfor %}
        let certainty = coverage * coverage;
        (*known).light.lamps_linear += own.lamps_linear * certainty;
        (*known).light.environment_linear += own.environment_linear * certainty;
        (*known).light.weight += own.weight * certainty;
{%- for word in range(share_words) %}
        (*known).light.shares{{ word }} += own.shares{{ word }} * certainty;
{%- endfor %}
        (*known).coverage = max((*known).coverage, coverage);
        (*known).camera_mask |= select(0u, 1u << number, coverage > 0.0);
    }
}

// Adds the light of a texel, as it would be with the point's own normal.
fn add_texel(texel: Texel, certainty: f32, point: Point, own: ptr<function, CachedLight>, known: ptr<function, Known>) {
    let more = textureLoad(samples, texel_at(texel.first + 1u), 0);
    var lamps = linear_from_rgb9e5(texel.words.w);
    var environment = linear_from_rgb9e5(more.x);
{%- if share_words > 3 %}
    let rest = textureLoad(samples, texel_at(texel.first + 2u), 0);
{%- endif %}
{%- for word in range(share_words) %}
    let shares{{ word }} = unpack4x8unorm({% if word < 3 %}more[{{ word + 1 }}u]{% else %}rest[{{ word - 3 }}u]{% endif %});
{%- endfor %}
    if texel.weight > 0.0 && texel.words.z != point.normal_oct16 {
        let normal = unit_from_oct16(texel.words.z);
        lamps *= ratio_of(
            expected_of_lamps(point.normal{% for word in range(share_words) %}, shares{{ word }}{% endfor %}),
            expected_of_lamps(normal{% for word in range(share_words) %}, shares{{ word }}{% endfor %}),
        );
        // Light that surfaces send back is there without an environment, too.
        let expected = expected_of_environment(normal);
        environment *= select(1.0, ratio_of(expected_of_environment(point.normal), expected), expected > 0.0);
    }
    let total = luminance(lamps + environment);
    let agrees = texel.weight > LEAST_WEIGHT;
    (*known).least_luminance = select((*known).least_luminance, min((*known).least_luminance, total), agrees);
    (*known).greatest_luminance = select((*known).greatest_luminance, max((*known).greatest_luminance, total), agrees);
    let share = texel.weight * certainty;
    (*own).lamps_linear += lamps * share;
    (*own).environment_linear += environment * share;
    (*own).weight += share;
{%- for word in range(share_words) %}
    (*own).shares{{ word }} += shares{{ word }} * share;
{%- endfor %}
}

fn is_known(known: Known) -> bool {
    let difference = known.greatest_luminance - known.least_luminance;
    let agrees = difference <= cache.tests.most_difference * max(known.greatest_luminance, LEAST_LUMINANCE);
    return known.light.weight > 0.0 && known.coverage >= cache.tests.least_coverage && agrees;
}

fn put(plane: u32, place: u32, value: f32) { sums[camera.first_sum + plane * camera.pixel_count + place] = value; }

// Writes light as the sums of rays.
fn put_light(light: CachedLight, place: u32) {
    let scale = vec2f(f32(camera.shadow_rays_in_sum), f32(camera.ambient_rays_in_sum)) / light.weight;
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

{%- if positions == "Later" %}

// Whether a point of a later position is on the plane of the first position's surface and turned alike: then it has its light.
fn is_like_first(point: Point, first: vec4u) -> bool {
    let triangle_normal = unit_from_oct16(first.y);
    let from_plane_m = abs(dot(triangle_normal, point.offset) - bitcast<f32>(first.x));
    let is_turned_alike = dot(triangle_normal, point.triangle_normal) >= ALIKE_TRIANGLES
        && dot(unit_from_oct16(first.z), point.normal) >= ALIKE_NORMALS;
    return is_turned_alike && from_plane_m <= ALIKE_FOOTPRINTS * point.footprint_m;
}
{%- endif %}

// Lists a point that samples do not know well enough.
fn leave_to_rays(light: CachedLight, place: u32) {
{%- if indirect %}
    // Indirect light changes slowly: it is known wherever a texel counts, and only lamps are asked.
    if light.weight > 0.0 {
        put_light(light, place);
        list_pixel_last(place);
        return;
    }
{%- endif %}
    list_pixel(place);
}

// Writes the light of a point, or lists its pixel; gives its provenance.
fn look_up(point: Point, place: u32) -> u32 {
    var known: Known;
    known.least_luminance = 3.0e38;
{%- if lamp_vectors %}
    find_lamps(camera.eye_in_world + point.offset);
{%- endif %}
{%- for number in range(camera_count) %}
    consult(cache.cameras[{{ number }}u], {{ number }}u, point, &known);
{%- endfor %}
    if !is_known(known) {
        leave_to_rays(known.light, place);
        return PROVENANCE_LIT_HERE;
    }
{%- if visibility and light_count > max_lamp_shares %}
    put_other_lamps(known.light, place);
{%- endif %}
    put_light(known.light, place);
    return PROVENANCE_HIT | known.camera_mask << 8u;
}

fn put_origin(place: u32, origin: u32) {
{%- if provenance_plane %}
    words[camera.first_word + {{ provenance_plane }}u * camera.pixel_count + place] = origin;
{%- endif %}
}

{%- if positions == "Asked" %}

@compute @workgroup_size(LIST_WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= asked.count { return; }
    let place = asked_pixels[id.x];
    let pixel = vec2u(place % camera.size_px.x, place / camera.size_px.x);
    let planar_depth_m = camera.near_m / max(reversed_depth_at(pixel), 1e-30);
    put_origin(place, look_up(point_at(pixel, planar_depth_m, surface_at(pixel)), place));
}
{%- else %}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = pixel_at(id);
    if is_beyond(pixel) { return; }
    let place = place_of(pixel);
    let depth = reversed_depth_at(pixel);
    let surface = surface_at(pixel);
    let met = depth > 0.0;
    let needs_light = met && (surface.x & SHOWN_AS_IT_IS) == 0u;
    let point = point_at(pixel, camera.near_m / max(depth, 1e-30), surface);
    var origin = select(PROVENANCE_EMPTY, PROVENANCE_HIT, met);
{%- if positions == "Later" %}
    let kept_place = camera.first_word / {{ plane_count }}u + place;
    let first = textureLoad(first_surfaces, pixel, 0);
    let is_kept = kept[kept_place] == 1u && is_like_first(point, first);
    if needs_light && is_kept { origin = first.w; }
    if needs_light && !is_kept {
        kept[kept_place] = 0u;
        list_pixel(place);
    }
{%- else %}
    if needs_light { origin = look_up(point, place); }
{%- endif %}
{%- if positions == "First" %}
    let is_answered = needs_light && origin != PROVENANCE_LIT_HERE;
    kept[camera.first_word / {{ plane_count }}u + place] = select(0u, 1u, is_answered);
    let from_eye_m = dot(point.triangle_normal, point.offset);
    let triangle_normal = textureLoad(triangle_normals, pixel, 0).x;
    textureStore(first_surfaces, pixel, vec4u(bitcast<u32>(from_eye_m), triangle_normal, surface.z, origin));
{%- endif %}
    put_origin(place, origin);
}
{%- endif %}
