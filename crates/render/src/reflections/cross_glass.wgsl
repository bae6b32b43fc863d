// A ray's way through surfaces that light goes through.

// The exponent of what a metre of the medium takes in which the ray is.
var<private> medium_per_m: vec3f = vec3f(0.0);

// A surface that a ray has met, with what decides where the ray goes on.
struct Interface {
    glass: Glass,
    // Unit vectors against the ray, of shading and of the triangle.
    normal: vec3f,
    flat_normal: vec3f,
    // Towards the ray, positive where convex.
    curvature_per_m: f32,
    // The ray comes from outside, or there is no inside.
    enters: bool,
}

fn interface_at(hit: Hit, side_m: f32) -> Interface {
    let triangle = textureLoad(flat_triangles, texel_at(hit.slot), 0);
    let at = attributes_at(hit.crossing);
    let footprints = uv_footprints(hit.crossing, hit.slot, side_m);
    let glass = glass_of(triangle, at, footprints);
    let facing = select(-1.0, 1.0, hit.crossing.front);
    let corner = bitcast<vec3f>(corner_texel(hit.slot * 3u).xyz);
    let first_edge = bitcast<vec3f>(corner_texel(hit.slot * 3u + 1u).xyz) - corner;
    let second_edge = bitcast<vec3f>(corner_texel(hit.slot * 3u + 2u).xyz) - corner;
    return Interface(
        glass, normal_at(triangle.z, at, footprints) * facing, normalize(cross(first_edge, second_edge)) * facing,
        curvature_of(hit.crossing, hit.slot) * facing, hit.crossing.front || glass.thin,
    );
}

// The ray beyond an interface, or back from it. Where the normal of shading leads to the wrong side, the triangle's counts.
fn deflected_at(boundary: Interface, direction: vec3f, eta: f32) -> Deflection {
    var deflection = deflected(direction, boundary.normal, eta);
    let leaves = dot(deflection.direction, boundary.flat_normal) > 0.0;
    if dot(direction, boundary.normal) >= 0.0 || leaves != deflection.total {
        deflection = deflected(direction, boundary.flat_normal, eta);
    }
    return deflection;
}

// Turns a ray that has met glass into the ray that goes on from there, with this share of the light.
fn go_through(hit: Hit, boundary: Interface, share: f32, ray: ptr<function, Bounce>) {
    let glass = boundary.glass;
    let front = hit.crossing.front;
    let direction = (*ray).direction;
    let signed_m = (*ray).side_m + (*ray).spread * hit.t;
    let side_m = abs(signed_m);
    let spread = select((*ray).spread, -(*ray).spread, signed_m < 0.0);
    let eta = select(glass.ior, 1.0 / glass.ior, boundary.enters);
    var deflection = deflected_at(boundary, direction, eta);
    let reflectance = fresnel(clamp(-dot(direction, boundary.normal), 0.0, 1.0), eta);
    if glass.thin { deflection = Deflection(direction, 0.0, false); }
    // A back says which medium the ray was in, even where its way began inside.
    let passed_per_m = select(medium_per_m, glass.absorption_per_m, !boundary.enters);
    let passes = select((1.0 - reflectance) * share, 1.0, deflection.total);
    let tint_linear = select(vec3f(1.0), glass.tint_linear, boundary.enters && !deflection.total);
    let offset = direction * hit.t;
    let size = abs((*ray).point_in_world) + abs(offset);
    let bias_m = BIAS_FOOTPRINTS * side_m + BIAS_ROUNDINGS * max(max(size.x, size.y), size.z);
    let above = boundary.flat_normal * select(-bias_m, bias_m, deflection.total);
    (*ray).point_in_world += offset + above;
    (*ray).direction = deflection.direction;
    (*ray).throughput_linear *= tint_linear * exp(-passed_per_m * hit.t) * passes;
    (*ray).side_m = side_m;
    // Ray cones: the direction turns as the ray's does, and with the normal over the footprint.
    let scale = select(eta, 1.0, glass.thin || deflection.total);
    (*ray).spread = spread * scale + deflection.steer * boundary.curvature_per_m * side_m;
    (*ray).near_m = 0.0;
    if !glass.thin { medium_per_m = select(vec3f(0.0), glass.absorption_per_m, front != deflection.total); }
}

// Whether a ray goes on through what it has met. A surface that lets a part of the light through is there for that part of the rays,
// by a hash; but an eye's first surface sends on its share.
fn crosses(hit: Hit, number: u32, ray: ptr<function, Bounce>) -> bool {
    let is_glass = (textureLoad(flat_triangles, texel_at(hit.slot), 0).w & GLASS) != 0u;
    var goes_on = false;
    for (var needed = is_glass; needed; needed = false) {
        let boundary = interface_at(hit, abs((*ray).side_m + (*ray).spread * hit.t));
        let is_first = number == 0u && (*ray).unmirrored != 0u;
        let chance = f32(hashed((*ray).seed ^ hashed(number)) >> 8u) / 16777216.0;
        goes_on = !boundary.enters || is_first || chance < boundary.glass.transmission;
        let share = select(1.0, boundary.glass.transmission, boundary.enters && is_first);
        for (var going = goes_on; going; going = false) { go_through(hit, boundary, share, ray); }
    }
    return goes_on;
}
