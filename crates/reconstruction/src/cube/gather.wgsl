// Light that comes to a surface from around the way of a mirrored ray, gathered from the directions of a layered light field
// (Lischinski §4.2).

struct LightField {
    directions: u32,
    // Parts of an edge of the octahedron whose vertices they are.
    divisions: u32,
    // Lines along each side of a direction's square.
    side_px: u32,
    // Of the lobe at mirrors, around the mirrored ray.
    exponent: f32,
    // Narrower lobes are as wide as this one: they hold three directions.
    least_alpha: f32,
}

@group(0) var<uniform> light_field: LightField;
// Four texels a direction: where light goes and its solid angle; rows that take (point_in_world, 1) to the column and the row among the
// lines, and to the depth behind which samples send light to the point.
@group(0) var light_directions: texture_2d<u32>;
// For each cell of both halves of the octahedron, seen from above: the nearest direction. After them for each direction all, by rising
// angle to it.
@group(0) var light_orders: texture_2d<u32>;
// The first sample of a line, and the one after its last.
@group(0) var light_lines: texture_2d<u32>;
// Depth and radiance.
@group(0) var light_samples: texture_2d<u32>;

fn light_texel(direction: u32, texel: u32) -> vec4f {
    return bitcast<vec4f>(textureLoad(light_directions, texel_at(4u * direction + texel), 0));
}

// How much a surface reflects of the light from a direction, beside that from the mirrored one.
fn lobe_share(mirror: Mirror, mirrored: vec3f, towards_light: vec3f) -> f32 {
    let n_l = dot(mirror.normal, towards_light);
    if n_l <= 0.0 { return 0.0; }
    if mirror.reflector.roughness < ROUGHEST_MIXED { return pow(max(dot(mirrored, towards_light), 0.0), light_field.exponent); }
    let alpha = max(ggx_alpha(mirror.reflector.roughness), light_field.least_alpha);
    let half_way = unit_or_zero(towards_light + mirror.towards_eye);
    let n_v = max(dot(mirror.normal, mirror.towards_eye), LEAST_COSINE);
    let lobe = ggx_distribution(mirror.normal, half_way, alpha) * ggx_visibility(n_l, n_v, alpha) * n_l;
    return lobe * alpha * alpha / max(ggx_visibility(n_v, n_v, alpha) * n_v, 1e-12);
}

// The direction that is nearest to a unit vector, or nearly so.
fn nearest_direction(towards: vec3f) -> u32 {
    let scale = f32(light_field.divisions) / (abs(towards.x) + abs(towards.y) + abs(towards.z));
    let side = 2 * i32(light_field.divisions) + 1;
    let at = vec2i(round(towards.xy * scale)) + i32(light_field.divisions);
    let cell = (select(0, side, towards.z < 0.0) + at.y) * side + at.x;
    return textureLoad(light_orders, texel_at(u32(cell)), 0).x;
}

fn direction_in_order(nearest: u32, place: u32) -> u32 {
    let side = 2u * light_field.divisions + 1u;
    return textureLoad(light_orders, texel_at(2u * side * side + nearest * light_field.directions + place), 0).x;
}

// The angle from the mirrored ray beyond which directions do not count.
fn lobe_angle(mirror: Mirror, is_rough: bool) -> f32 {
    // Masking and the cosine weigh some directions more than the mirrored one.
    let alpha = max(ggx_alpha(mirror.reflector.roughness), light_field.least_alpha);
    let rough = 2.0 * atan(alpha * sqrt(sqrt(MOST_MASKING / LEAST_LOBE_SHARE) - 1.0));
    return select(acos(pow(LEAST_LOBE_SHARE, 1.0 / light_field.exponent)), rough, is_rough);
}

// The light of the first surface on a line behind a depth, and how far behind; or what is around the scene, at no distance.
fn light_on_line(line: u32, depth_m: f32, around: vec3f) -> vec4f {
    let ends = textureLoad(light_lines, texel_at(line), 0).xy;
    var found = false;
    var light = vec4f(around, 0.0);
    for (var sample = ends.x; sample < ends.y && !found; sample++) {
        let words = textureLoad(light_samples, texel_at(sample), 0);
        let behind_m = bitcast<f32>(words.x) - depth_m;
        found = behind_m >= 0.0;
        light = select(light, vec4f(linear_from_rgb9e5(words.y), behind_m), found);
    }
    return light;
}

// The line of a direction whose square holds a place, or the nearest to it.
fn line_at(direction: u32, place: vec2f) -> u32 {
    let at = vec2u(clamp(place, vec2f(0.0), vec2f(f32(light_field.side_px - 1u))));
    return (direction * light_field.side_px + at.y) * light_field.side_px + at.x;
}

// The same light between the four lines around a place.
fn light_between_lines(direction: u32, place: vec2f, depth_m: f32, around: vec3f) -> vec3f {
    let first = floor(place - 0.5);
    let share = place - 0.5 - first;
    var light = vec3f(0.0);
    for (var corner = 0u; corner < 4u; corner++) {
        let step = vec2f(vec2u(corner & 1u, corner >> 1u));
        let weights = select(1.0 - share, share, step == vec2f(1.0));
        let at = first + step;
        // Beside the square the scene has nothing.
        let is_beside = any(at < vec2f(-1.0)) || any(at > vec2f(f32(light_field.side_px)));
        let own = select(light_on_line(line_at(direction, at), depth_m, around).rgb, around, is_beside);
        light += own * (weights.x * weights.y);
    }
    return light;
}

// The light that comes to a point from around a direction; `towards` has the direction and its solid angle.
fn light_through(direction: u32, towards: vec4f, point_in_world: vec3f, is_rough: bool) -> vec3f {
    let p = vec4f(point_in_world, 1.0);
    let column = light_texel(direction, 1u);
    let place = vec2f(dot(column, p), dot(light_texel(direction, 2u), p));
    let depth_m = dot(light_texel(direction, 3u), p);
    let around = environment_mirrored(-towards.xyz, LEAST_ROUGHNESS);
    // A direction stands for all within its solid angle: they see more of a surface the farther it is. Without that a wide lobe shows
    // as many separate images of it as it holds directions.
    var width_px = 0.0;
    for (var wide = is_rough; wide; wide = false) {
        let behind_m = light_on_line(line_at(direction, place), depth_m, around).w;
        width_px = FOOTPRINT_SHARE * behind_m * sqrt(towards.w) * length(column.xyz);
    }
    let places = select(1u, 4u, is_rough);
    var light = vec3f(0.0);
    for (var i = 0u; i < places; i++) {
        let offset = vec2f(vec2u(i & 1u, i >> 1u)) - 0.5;
        light += light_between_lines(direction, place + offset * width_px, depth_m, around);
    }
    return light / f32(places);
}

// The mean light of a lobe.
fn gathered_light(mirror: Mirror) -> vec3f {
    let mirrored = reflect(-mirror.towards_eye, mirror.normal);
    let is_rough = mirror.reflector.roughness >= ROUGHEST_MIXED;
    var light = vec3f(0.0);
    var sum = 0.0;
    let nearest = nearest_direction(-mirrored);
    let middle = light_texel(nearest, 0u).xyz;
    let farthest = lobe_angle(mirror, is_rough) + acos(clamp(dot(middle, -mirrored), -1.0, 1.0));
    let least_cosine = cos(min(farthest, LIGHT_PI));
    var is_within = true;
    for (var place = 0u; place < light_field.directions && is_within; place++) {
        let direction = direction_in_order(nearest, place);
        let own = light_texel(direction, 0u);
        is_within = dot(middle, own.xyz) >= least_cosine;
        let share = lobe_share(mirror, mirrored, -own.xyz);
        for (var counts = is_within && share > LEAST_LOBE_SHARE; counts; counts = false) {
            light += light_through(direction, own, mirror.point_in_world, is_rough) * (share * own.w);
            sum += share * own.w;
        }
    }
    // A narrow lobe along a surface may hold no direction.
    return select(environment_mirrored(mirrored, LEAST_ROUGHNESS), light / max(sum, 1e-12), sum > 0.0);
}
