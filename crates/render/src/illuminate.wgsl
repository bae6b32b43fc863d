// Light that arrives at each pixel's surface from every lamp and from the environment, with rays where they are asked for.
// The sums are such that later rays can be added.
{% include "camera.wgsl" %}
{% if indirect %}
{% include "packed_surface.wgsl" %}
{% else %}
{% include "color.wgsl" %}
{% include "normal.wgsl" %}
{% endif %}
{% include "light.wgsl" %}
{% if environment_map and not traced %}
{% include "table.wgsl" %}
{% endif %}
{% include "sequence.wgsl" %}
{%- if bounces %}
{% include "reflections/bounce.wgsl" %}
{%- else %}
{% include "surfaces.wgsl" %}
{%- endif %}
{% if traced %}
{% include "rays/traverse.wgsl" %}
{% endif %}

@group(0) var<uniform> illumination: Illumination;
// The sums of each camera, plane by plane (sums.wgsl).
@group(0) var<storage, read_write> sums: array<f32>;
{% include "sums.wgsl" %}
{% if bounces %}
@group(0) var<storage, read> bounces: array<Bounce>;
@group(0) var<storage, read> list: BounceList;
{% elif listed %}
struct List { workgroups: u32, y: u32, z: u32, count: u32, last_count: u32 }
@group(0) var<storage, read> listed_pixels: array<u32>;
@group(0) var<storage, read> list: List;
{% endif %}

{% include "rise.wgsl" %}
{%- if bounces %}

fn spot_of(bounce: Bounce) -> Spot {
    let normal = unit_from_oct16(bounce.surface.z);
    return Spot(bounce.point_in_world, normal, bounce.point_in_world + normal * bounce.bias_m, bounce.bias_m, bounce.seed);
}
{%- else %}

{% include "spot.wgsl" %}
{%- endif %}
{% if grid %}

{% include "grid.wgsl" %}
{% endif %}
{% if bits %}

// The pixel whose bits are read.
var<private> lit_place: u32;

fn is_open(lamp: u32, number: u32) -> bool {
    let bit = bit_of(number);
    return (lamp_bits[first_bit_word(lit_place, lamp) + bit / 32u] >> (bit % 32u) & 1u) != 0u;
}
{% endif %}

struct Arrival { linear: vec3f, open: f32 }

{% if environment_map %}
// The number after those of the lamps: bright texels of the environment map are traced like a lamp.
fn is_bright(number: u32) -> bool { return number == illumination.light_count; }
{% endif %}

// The light of one point of a lamp, were nothing in between.
fn incident_of(number: u32, spot: Spot, place: vec2f) -> Incident {
{% if environment_map %}
    if is_bright(number) { return incident_from_bright(place); }
{% endif %}
    return incident_from(illumination.lights[number], spot.point, place);
}
{% if traced %}

// The share of a ray that arrives: what is not blocked, less what glass on the way takes.
fn open_share(ray: Ray, t_max: f32) -> vec3f {
    let blocked = is_blocked(ray, t_max);
    return select({{ "passed_linear" if glass else "vec3f(1.0)" }}, vec3f(0.0), blocked);
}

// What arrives of it. Green stands for the open share of all colours.
fn arrival_of(incident: Incident, spot: Spot) -> Arrival {
    let cosine = dot(spot.normal, incident.towards);
    var open = vec3f(0.0);
    // A loop, not a branch: the software device skips only loops that no lane needs.
    for (var lit = cosine > 0.0 && any(incident.irradiance_linear > vec3f(0.0)); lit; lit = false) {
        open = open_share(ray_from(spot.origin, incident.towards), incident.distance_m - spot.bias_m);
    }
    return Arrival(incident.irradiance_linear * (max(cosine, 0.0) * open), open.g);
}
{% endif %}

// The light of one lamp: the sum over its rays.
fn from_lamp(number: u32, spot: Spot) -> Arrival {
{% if not shadows and continued %}
    // Known at once, and in the sums already.
    return Arrival(vec3f(0.0), 0.0);
{% elif not shadows %}
    let incident = incident_of(number, spot, vec2f(0.5));
    return Arrival(incident.irradiance_linear * max(dot(spot.normal, incident.towards), 0.0), 1.0);
{% else %}
    var arrival = Arrival(vec3f(0.0), 0.0);
    for (var i = 0u; i < camera.shadow_rays; i++) {
{% if not soft and environment_map %}
        // Bright texels have no middle.
        let place = select(vec2f(0.5), point_of(camera.first_shadow_ray + i, hashed(spot.seed + number)), is_bright(number));
{% elif not soft %}
        let place = vec2f(0.5);
{% elif grid and environment_map %}
        // Bright texels are no lamp with a grid.
        let random = point_of(camera.first_shadow_ray + i, hashed(spot.seed + number));
        let place = select(grid_place(camera.first_shadow_ray + i), random, is_bright(number));
{% elif grid %}
        let place = grid_place(camera.first_shadow_ray + i);
{% else %}
        let place = point_of(camera.first_shadow_ray + i, hashed(spot.seed + number));
{% endif %}
{% if bits %}
        let incident = incident_of(number, spot, place);
        let has_bits = {{ "!is_bright(number)" if environment_map else "true" }};
        let open = select(0.0, 1.0, has_bits && is_open(number, camera.first_shadow_ray + i));
        var ray = Arrival(incident.irradiance_linear * (max(dot(spot.normal, incident.towards), 0.0) * open), open);
{% if environment_map %}
        for (var needed = !has_bits; needed; needed = false) { ray = arrival_of(incident, spot); }
{% endif %}
{% else %}
        let ray = arrival_of(incident_of(number, spot, place), spot);
{% endif %}
        arrival.linear += ray.linear;
        arrival.open += ray.open;
    }
    return arrival;
{% endif %}
}

{% if indirect %}

{% include "indirect.wgsl" %}
{% endif %}

// With indirect light, what surfaces send back is part of it.
fn from_environment(spot: Spot, ambient_rays: u32) -> Arrival {
{% if ambient %}
    let around = tangents_of(spot.normal);
    var arrival = Arrival(vec3f(0.0), 0.0);
    for (var i = 0u; i < ambient_rays; i++) {
        let number = camera.first_ambient_ray + i;
        let disc = disc_from_square(point_of(number, hashed(spot.seed + 0x5bd1e995u)));
        let up = sqrt(max(1.0 - dot(disc, disc), 0.0));
        let towards = around.tangent * disc.x + around.bitangent * disc.y + spot.normal * up;
{% if indirect %}
        let ray = indirect_ray(spot, towards, number);
        arrival.linear += ray.linear;
        arrival.open += ray.open;
    }
{% else %}
        let open = open_share(ray_from(spot.origin, towards), camera.occlusion_radius_m);
        arrival.linear += {{ "environment_base" if environment_map else "environment_radiance" }}(towards) * open;
        arrival.open += open.g;
    }
{% endif %}
{% if environment_map and not shadows %}
    // Lamps have no rays: bright texels take as many as there are of occlusion.
    for (var i = 0u; i < ambient_rays && has_bright_texels(); i++) {
        let place = point_of(camera.first_ambient_ray + i, hashed(spot.seed + illumination.light_count));
        arrival.linear += arrival_of(incident_from_bright(place), spot).linear;
    }
{% endif %}
    return arrival;
{% elif continued %}
    return Arrival(vec3f(0.0), 0.0);
{% elif environment_map and shadows %}
    return Arrival(environment_base_diffuse(spot.normal), 1.0);
{% else %}
    return Arrival(environment_diffuse(spot.normal), 1.0);
{% endif %}
}

fn index_of(plane: u32, place: u32) -> u32 { return camera.first_sum + plane * camera.pixel_count + place; }

fn add(plane: u32, place: u32, value: f32) {
    let index = index_of(plane, place);
{% if continued %}
    sums[index] += value;
{% else %}
    sums[index] = value;
{% endif %}
}

fn add_color(plane: u32, place: u32, linear: vec3f) {
    add(plane, place, linear.r);
    add(plane + 1u, place, linear.g);
    add(plane + 2u, place, linear.b);
}
{%- if bounces %}

fn light_bounce(place: u32) {
    let bounce = bounces[place];
    var lamps_linear = vec3f(0.0);
    var environment = Arrival(vec3f(0.0), 0.0);
    for (var found = bounce.met != 0u; found; found = false) {
        let spot = spot_of(bounce);
{% if traced and alpha_tested and mapped %}        cone_side_m = bounce.side_m;
{% endif %}
{%- else %}

fn light_pixel(pixel: vec2u, knows_ambient: bool) {
    let place = place_of(pixel);
{% if bits %}    lit_place = place;
{% endif %}
    let depth = reversed_depth_at(pixel);
    var lamps_linear = vec3f(0.0);
    var environment = Arrival(vec3f(0.0), 0.0);
    for (var found = depth > 0.0; found; found = false) {
        let spot = spot_of(pixel, depth, surface_at(pixel));
{% if traced and alpha_tested and mapped %}        cone_side_m = camera.near_m / depth * camera.footprint;
{% endif %}
{%- endif %}
        environment = from_environment(spot, {{ "select(camera.ambient_rays, 0u, knows_ambient)" if knows_ambient else "camera.ambient_rays" }});
{% if visibility and not continued %}
        for (var number = 0u; number < illumination.light_count; number++) { add(OPEN_TO_LAMPS + number, place, 0.0); }
{% endif %}
        for (var number = camera.first_light; number < camera.end_light; number++) {
            let lamp = from_lamp(number, spot);
            lamps_linear += lamp.linear;
{% if visibility and environment_map %}            if is_bright(number) { continue; }
{% endif %}
{% if visibility %}            sums[index_of(OPEN_TO_LAMPS + number, place)] += lamp.open;
{% endif %}
        }
    }
    add_color(LAMPS, place, lamps_linear);
{%- if knows_ambient %}
    if knows_ambient { return; }
{%- endif %}
    add_color(ENVIRONMENT, place, environment.linear);
{% if visibility %}    add(OPEN_TO_ENVIRONMENT, place, environment.open);
{% endif %}
}

{% if bounces %}
@compute @workgroup_size(LIST_WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= list.count { return; }
    light_bounce(id.x);
}
{% elif listed %}
@compute @workgroup_size(LIST_WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let first_count = (list.count + LIST_WORKGROUP - 1u) / LIST_WORKGROUP * LIST_WORKGROUP;
    let is_last = id.x >= first_count;
    let entry = select(id.x, id.x - first_count, is_last);
    if entry >= select(list.count, list.last_count, is_last) { return; }
    let place = listed_pixels[select(entry, arrayLength(&listed_pixels) - 1u - entry, is_last)];
    let pixel = vec2u(place % camera.size_px.x, place / camera.size_px.x);
    light_pixel(pixel, is_last);
}
{% else %}
@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = pixel_at(id);
    if is_beyond(pixel) { return; }
    light_pixel(pixel, false);
}
{% endif %}
