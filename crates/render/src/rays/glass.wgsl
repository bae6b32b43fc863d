// Surfaces that light goes through: their share, Snell's law, and Fresnel's formulas for a dielectric. The twin is
// scalar/glass.rs.

struct Glass {
    // Of the light that enters the surface, the share that goes on.
    transmission: f32,
    ior: f32,
    // Of the light that goes on.
    tint_linear: vec3f,
    // The exponent of what a metre of the medium takes.
    absorption_per_m: vec3f,
    // There is no medium: light goes straight through.
    thin: bool,
}

fn glass_of(triangle: vec4u, at: Attributes, footprints: vec2f) -> Glass {
    let material = triangle.z;
    let factors = material_texel(material, 2u);
    let medium = bitcast<vec4f>(material_texel(material, 7u));
    let coat = sampled(material_texel(material, 4u).zw, use_of(factors.w, 1u), at, footprints);
    let metallic = bitcast<f32>(factors.x) * coat.b;
    return Glass(
        bitcast<f32>(material_texel(material, 6u).w) * (1.0 - metallic), medium.w, base_color(material, at, footprints).rgb,
        medium.xyz, (triangle.w & THIN) != 0u,
    );
}

// The share of unpolarised light that an interface reflects. `eta` is the refractive index on the light's side over that beyond.
fn fresnel(cosine: f32, eta: f32) -> f32 {
    let sine_squared = eta * eta * (1.0 - cosine * cosine);
    let beyond = sqrt(max(1.0 - sine_squared, 0.0));
    let across = (eta * cosine - beyond) / max(eta * cosine + beyond, 1e-20);
    let along = (cosine - eta * beyond) / max(cosine + eta * beyond, 1e-20);
    return select(0.5 * (across * across + along * along), 1.0, sine_squared >= 1.0);
}

// Where light goes at an interface: on, or back where all of it is reflected. `steer` is the share of the normal in the direction.
struct Deflection { direction: vec3f, steer: f32, total: bool }

// `direction` and `normal` are unit vectors against each other.
fn deflected(direction: vec3f, normal: vec3f, eta: f32) -> Deflection {
    let cosine = clamp(-dot(direction, normal), 0.0, 1.0);
    let sine_squared = eta * eta * (1.0 - cosine * cosine);
    let total = sine_squared >= 1.0;
    let steer = select(eta * cosine - sqrt(max(1.0 - sine_squared, 0.0)), 2.0 * cosine, total);
    let deflected = direction * select(eta, 1.0, total) + normal * steer;
    return Deflection(deflected * inverseSqrt(max(dot(deflected, deflected), 1e-20)), steer, total);
}

// The share of a ray of light that the glass on its way lets through, once `is_blocked` is done.
var<private> passed_linear: vec3f = vec3f(1.0);
// The exponent of what media on the way take: backs add the way to them, and fronts subtract it.
var<private> absorbed: vec3f = vec3f(0.0);

// Light goes straight through a surface, tinted, and less what it reflects. `direction` is a unit vector.
fn pass_straight(slot: u32, crossing: Crossing, direction: vec3f) {
    let triangle = textureLoad(flat_triangles, texel_at(slot), 0);
    let at = attributes_at(crossing);
    let glass = glass_of(triangle, at, vec2f(0.0));
    let cosine = min(abs(dot(normalize(at.normal + vec3f(0.0, 1e-20, 0.0)), direction)), 1.0);
    let enters = crossing.front || glass.thin;
    passed_linear *= select(vec3f(1.0), glass.tint_linear * glass.transmission, enters) * (1.0 - fresnel(cosine, 1.0 / glass.ior));
    absorbed += glass.absorption_per_m * select(crossing.t, -crossing.t, crossing.front);
}
