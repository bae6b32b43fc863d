// Which places of a grid on a lamp the surface of each pixel sees (Xie et al. 2016, Algorithm 5): by shadow maps from the places, by walks
// through a layered cube, or by rays, as for places that neither answers for.
{% include "camera.wgsl" %}
{% include "color.wgsl" %}
{% include "normal.wgsl" %}
{% include "light.wgsl" %}
{% include "sequence.wgsl" %}
{% include "surfaces.wgsl" %}
{% include "rays/traverse.wgsl" %}

@group(0) var<uniform> illumination: Illumination;

{% include "rise.wgsl" %}

{% include "spot.wgsl" %}

{% include "grid.wgsl" %}
{% if maps or cube %}

const OPEN: u32 = 0u;
const BLOCKED: u32 = 1u;
const BEYOND: u32 = 2u;
{% endif %}
{% if maps %}

struct LampPoint { eye_in_world: vec3f, near_m: f32, principal_px: vec2f }

// Cameras at places of the lamp, one for each layer of the maps. They share their axes and focal lengths.
struct LampMaps {
    right_in_world: vec3f,
    side_px: f32,
    down_in_world: vec3f,
    focal_x_px: f32,
    forward_in_world: vec3f,
    focal_y_px: f32,
    points: array<LampPoint, MAPS_AT_ONCE>,
}

@group(0) var<uniform> lamp_maps: LampMaps;
// Near plane over planar depth, 0 where there is nothing.
@group(0) var maps: texture_depth_2d_array;

// A surface is behind a map's only where it is farther by so many texels, the more the flatter light falls on it.
const BIAS_TEXELS: f32 = 0.5;
const BIAS_TEXELS_A_SLOPE: f32 = 0.75;
const MOST_SLOPE: f32 = 8.0;

fn seen_in_map(layer: u32, spot: Spot, cosine: f32) -> u32 {
    let near_m = lamp_maps.points[layer].near_m;
    let focal_px = vec2f(lamp_maps.focal_x_px, lamp_maps.focal_y_px);
    let from_eye = spot.point - lamp_maps.points[layer].eye_in_world;
    let depth_m = dot(lamp_maps.forward_in_world, from_eye);
    if depth_m <= near_m { return BEYOND; }
    let across = vec2f(dot(lamp_maps.right_in_world, from_eye), dot(lamp_maps.down_in_world, from_eye));
    let pixel = lamp_maps.points[layer].principal_px + focal_px * across / depth_m;
    if any(pixel < vec2f(0.0)) || any(pixel >= vec2f(lamp_maps.side_px)) { return BEYOND; }
    let nearest = textureLoad(maps, vec2u(pixel), layer, 0);
    let slope = sqrt(max(1.0 - cosine * cosine, 0.0)) / max(cosine, 1e-6);
    let texels = BIAS_TEXELS + BIAS_TEXELS_A_SLOPE * min(slope, MOST_SLOPE);
    let texel_m = depth_m / min(focal_px.x, focal_px.y);
    // In products: where there is nothing the map's depth is infinite.
    return select(OPEN, BLOCKED, nearest * (depth_m - texels * texel_m) > near_m);
}
{% endif %}
{% if cube %}
{% include "cube_walk.wgsl" %}

// Slanting rays leave the samples of the surface that they begin on as late as ones of this cosine.
const LEAST_COSINE_OFF: f32 = 0.25;

fn seen_in_cube(spot: Spot, incident: Incident, cosine: f32) -> u32 {
    let near_m = cube.start_m / max(cosine, LEAST_COSINE_OFF);
    let hit = walk(cube_ray(spot.point, incident.towards), near_m, incident.distance_m);
    return select(select(BEYOND, OPEN, hit.is_empty), BLOCKED, hit.met);
}
{% endif %}

fn sees(lamp: u32, spot: Spot, i: u32) -> bool {
    let incident = incident_from(illumination.lights[lamp], spot.point, grid_place(camera.first_shadow_ray + i));
    let cosine = dot(spot.normal, incident.towards);
    var needs_ray = cosine > 0.0 && any(incident.irradiance_linear > vec3f(0.0));
    var open = needs_ray;
{% if maps or cube %}
    var seen = OPEN;
    for (var asks = needs_ray; asks; asks = false) {
        seen = {{ "seen_in_map(i, spot, cosine)" if maps else "seen_in_cube(spot, incident, cosine)" }};
    }
    open = needs_ray && seen == OPEN;
    needs_ray = needs_ray && seen == BEYOND;
{% endif %}
    // A loop, not a branch: the software device skips only loops that no lane needs.
    for (; needs_ray; needs_ray = false) {
        open = !is_blocked(ray_from(spot.origin, incident.towards), incident.distance_m - spot.bias_m);
    }
    return open;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = pixel_at(id);
    if is_beyond(pixel) { return; }
    let lamp = camera.first_light;
    let first_word = first_bit_word(place_of(pixel), lamp);
    let depth = reversed_depth_at(pixel);
    let found = depth > 0.0;
    let spot = spot_of(pixel, max(depth, 1e-30), surface_at(pixel));
{% if alpha_tested and mapped %}    cone_side_m = camera.near_m / max(depth, 1e-30) * camera.footprint;
{% endif %}
    var word = bit_of(camera.first_shadow_ray) / 32u;
    var bits = lamp_bits[first_word + word];
    for (var i = 0u; i < camera.shadow_rays; i++) {
        let bit = bit_of(camera.first_shadow_ray + i);
        if bit / 32u != word {
            lamp_bits[first_word + word] = bits;
            word = bit / 32u;
            bits = lamp_bits[first_word + word];
        }
        var open = false;
        for (var needed = found; needed; needed = false) { open = sees(lamp, spot, i); }
        bits = insertBits(bits, select(0u, 1u, open), bit % 32u, 1u);
    }
    lamp_bits[first_word + word] = bits;
}
