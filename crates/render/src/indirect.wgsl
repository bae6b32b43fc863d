// Light that surfaces send back: what a ray brings from the first surface that it meets, or else from the environment. A surface
// sends its emission, and its diffuse reflection of one lamp, chosen by what each would bring there. The twin is scalar/indirect.rs.

// The growth of a ray's cone in a metre, for its textures: that of one of fifty rays over a hemisphere.
const INDIRECT_SPREAD: f32 = 0.25;
{%- if glass %}
// The light that glass takes is asked for up to so much before what the ray meets.
const INDIRECT_SLACK: f32 = 1e-4;
{%- endif %}
// Weights have a finite sum.
const MOST_WEIGHT: f32 = 1e30;

// The lamps, with the bright texels of a map as one.
fn lamp_count() -> u32 {
    return illumination.light_count{% if environment_map %} + select(0u, 1u, has_bright_texels()){% endif %};
}

// The luminance that a lamp would bring, were nothing in between.
fn weight_of(incident: Incident, normal: vec3f) -> f32 {
    let linear = incident.irradiance_linear * max(dot(normal, incident.towards), 0.0);
    return min(dot(linear, vec3f(0.2126, 0.7152, 0.0722)), MOST_WEIGHT);
}

// The light of one lamp as if it were that of all. `place` is on each lamp; `at`, from 0 to 1, chooses among them.
fn from_one_lamp(spot: Spot, place: vec2f, at: f32) -> Incident {
    var sum = 0.0;
    for (var number = 0u; number < lamp_count(); number++) { sum += weight_of(incident_of(number, spot, place), spot.normal); }
    var chosen = Incident(spot.normal, 0.0, vec3f(0.0));
    var before = 0.0;
    for (var number = 0u; number < lamp_count() && before <= at * sum; number++) {
        chosen = incident_of(number, spot, place);
        before += weight_of(chosen, spot.normal);
    }
    chosen.irradiance_linear *= sum / max(weight_of(chosen, spot.normal), 1e-30);
    return chosen;
}

fn sent_back(ray: Ray, hit: Hit, seen_from: Spot, number: u32) -> vec3f {
    let triangle = textureLoad(flat_triangles, texel_at(hit.slot), 0);
    let at = attributes_at(hit.crossing);
    let footprints = uv_footprints(hit.crossing, hit.slot, INDIRECT_SPREAD * hit.t);
    let base_linear = base_color(triangle.z, at, footprints).rgb;
    let coat = coat(triangle.z, triangle.w, at, footprints);
    let normal = normal_at(triangle.z, at, footprints) * select(-1.0, 1.0, hit.crossing.front);
    let point = ray.origin + ray.direction * hit.t;
    let size = abs(ray.origin) + abs(ray.direction * hit.t);
    let bias_m = seen_from.bias_m + BIAS_ROUNDINGS * max(max(size.x, size.y), size.z);
    let spot = Spot(point, normal, point + normal * bias_m, bias_m, seen_from.seed);
    let place = point_of(number, hashed(seen_from.seed + 0x68bc21ebu));
    let lamp = from_one_lamp(spot, place, point_of(number, hashed(seen_from.seed + 0x02e5be93u)).x);
    let lit_linear = base_linear * (1.0 - coat.metallic) * arrival_of(lamp, spot).linear;
    return emission(triangle.z, at, footprints) + select(lit_linear, base_linear, coat.unlit);
}

// What the ray of this number brings, and whether it is open to the environment.
fn indirect_ray(spot: Spot, towards: vec3f, number: u32) -> Arrival {
    let ray = ray_from(spot.origin, towards);
{%- if glass %}
    // Straight through glass, as rays to lamps.
    ignores_glass = true;
{%- endif %}
    let hit = closest(ray, 0.0, PARALLEL_M);
    var arrival = Arrival({{ "environment_base" if environment_map else "environment_radiance" }}(towards), 1.0);
    for (var met = hit.slot != NOTHING; met; met = false) {
        arrival = Arrival(sent_back(ray, hit, spot, number), 0.0);
    }
{%- if glass %}
    _ = is_blocked(ray, hit.t * (1.0 - INDIRECT_SLACK));
    arrival = Arrival(arrival.linear * passed_linear, arrival.open * passed_linear.g);
{%- endif %}
    return arrival;
}
