// The light of a scene; the twin of depth-image's light.rs. The includer declares
// `var<uniform> illumination: Illumination`.

struct Light {
    // The middle; for parallel light, the unit vector towards it.
    middle_in_world: vec3f,
    kind: u32,
    // Intensity; radiance of a rectangle, irradiance of parallel light.
    color_linear: vec3f,
    // Radius in metres; for parallel light the tangent of the angular radius.
    extent: f32,
    // A spot's axis, away from the light; the way from a rectangle's middle to that of an edge.
    axis_in_world: vec3f,
    // A spot's share of light: clamp((cosine - outer_cosine) · cone_scale)², 1 for all other lights.
    outer_cosine: f32,
    // The way from a rectangle's middle to that of the next edge.
    next_edge_in_world: vec3f,
    cone_scale: f32,
}

struct Illumination {
    zenith_linear: vec3f,
    light_count: u32,
    nadir_linear: vec3f,
    padding: u32,
    // At least one, though none may count.
    lights: array<Light, {{ light_slots }}>,
}

// Light that arrives at a point from one point of a light, were nothing in between.
struct Incident {
    towards: vec3f,
    // PARALLEL_M for parallel light.
    distance_m: f32,
    // On a surface that faces the light.
    irradiance_linear: vec3f,
}

struct Tangents { tangent: vec3f, bitangent: vec3f }

const LIGHT_PARALLEL: u32 = 0u;
// Points and spots.
const LIGHT_ROUND: u32 = 1u;
const LIGHT_RECTANGLE: u32 = 2u;

const PARALLEL_M: f32 = 1e30;
// Nearer to a light than this it grows no stronger: no division by zero.
const LEAST_DISTANCE_M: f32 = 1e-6;
const LIGHT_PI: f32 = 3.1415927;

// A vector of unit length; 0 for 0.
fn unit_or_zero(v: vec3f) -> vec3f {
    return v * inverseSqrt(max(dot(v, v), 1e-30));
}

// Two unit vectors perpendicular to `unit` and each other (Duff et al. 2017).
fn tangents_of(unit: vec3f) -> Tangents {
    let sign = select(-1.0, 1.0, unit.z >= 0.0);
    let a = -1.0 / (sign + unit.z);
    let b = unit.x * unit.y * a;
    return Tangents(
        vec3f(1.0 + sign * unit.x * unit.x * a, sign * b, -sign * unit.x),
        vec3f(b, sign + unit.y * unit.y * a, -unit.y),
    );
}

// The unit square to the unit disc, keeping areas and neighbours (Shirley and Chiu 1997).
fn disc_from_square(place: vec2f) -> vec2f {
    let p = place * 2.0 - 1.0;
    let wide = abs(p.x) > abs(p.y);
    let radius = select(p.y, p.x, wide);
    let share = select(p.x, p.y, wide) / select(radius, 1.0, radius == 0.0);
    let angle = select(0.5 * LIGHT_PI - 0.25 * LIGHT_PI * share, 0.25 * LIGHT_PI * share, wide);
    return vec2f(cos(angle), sin(angle)) * radius;
}

// From `place` in the unit square of the light, vec2f(0.5) being its middle; the mean over the square is the
// whole light's. All kinds at once: on a device of wide lanes a branch would save nothing.
fn incident_from(light: Light, point_in_world: vec3f, place: vec2f) -> Incident {
    let parallel = light.kind == LIGHT_PARALLEL;
    let rectangle = light.kind == LIGHT_RECTANGLE;
    let middle = light.middle_in_world - select(point_in_world, vec3f(0.0), parallel);
    let to_middle = unit_or_zero(middle);
    // A round light is a disc that faces the point, as a sphere is seen from afar.
    let facing = tangents_of(select(to_middle, vec3f(0.0, 1.0, 0.0), dot(middle, middle) < 1e-30));
    let disc = disc_from_square(place) * light.extent;
    let square = place * 2.0 - 1.0;
    let on_disc = facing.tangent * disc.x + facing.bitangent * disc.y;
    let on_rectangle = light.axis_in_world * square.x + light.next_edge_in_world * square.y;
    let offset = middle + select(on_disc, on_rectangle, rectangle);
    let distance_m = max(length(offset), LEAST_DISTANCE_M);
    let towards = offset / distance_m;
    // By Lambert's law, as seen from the side it shines to.
    let area_normal = cross(light.axis_in_world, light.next_edge_in_world);
    let seen_area = max(-dot(area_normal, towards), 0.0) * (4.0 / LIGHT_PI);
    let cone = clamp((-dot(light.axis_in_world, to_middle) - light.outer_cosine) * light.cone_scale, 0.0, 1.0);
    let share = select(cone * cone, seen_area, rectangle) / (distance_m * distance_m);
    return Incident(
        towards,
        select(distance_m, PARALLEL_M, parallel),
        light.color_linear * select(share, 1.0, parallel),
    );
}

// The tangent of half the angle that the light is seen under, as if it were round.
fn apparent_radius(light: Light, incident: Incident) -> f32 {
    let area_normal = cross(light.axis_in_world, light.next_edge_in_world);
    let seen_area = max(-dot(area_normal, incident.towards), 0.0) * (4.0 / LIGHT_PI);
    let radius_m = select(light.extent, sqrt(seen_area), light.kind == LIGHT_RECTANGLE);
    return radius_m / select(incident.distance_m, 1.0, light.kind == LIGHT_PARALLEL);
}

{% if environment_map %}
{% include "environment.wgsl" %}

// One point of the bright texels of the environment map, as a lamp.
fn incident_from_bright(place: vec2f) -> Incident {
    let bright = bright_from(place);
    return Incident(bright.towards, PARALLEL_M, bright.irradiance_linear);
}
{% else %}
// The radiance that arrives from far away in a direction: a gradient from straight down to straight up.
fn environment_radiance(direction: vec3f) -> vec3f {
    return mix(illumination.nadir_linear, illumination.zenith_linear, 0.5 + 0.5 * direction.y);
}

// The radiance that a white surface reflects of it, unoccluded: the gradient under a cosine lobe.
fn environment_diffuse(normal: vec3f) -> vec3f {
    return mix(illumination.nadir_linear, illumination.zenith_linear, 0.5 + normal.y * (1.0 / 3.0));
}

// The gradient as a surface mirrors it: a rough one's lobe sees less of it.
fn environment_mirrored(mirrored: vec3f, roughness: f32) -> vec3f {
    let alpha = roughness * roughness;
    let contrast = 1.0 - alpha * (0.5 - alpha * (1.0 / 6.0));
    return environment_radiance(mirrored * contrast);
}
{% endif %}
