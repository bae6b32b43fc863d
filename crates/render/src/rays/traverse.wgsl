// Rays against the triangles of a scene, through a tree with eight children a node whose boxes are in eight bits
// (Ylitie et al. 2017), front to back by octant. Everything is read as texels of four words: on the software
// device one such load costs a tenth of four loads from a storage buffer.
{% include "table.wgsl" %}

@group(1) var bvh_nodes: texture_2d<u32>;
// Three texels a triangle: a corner's position and number each.
@group(1) var triangle_corners: texture_2d<u32>;
@group(1) var flat_vertices: texture_2d<u32>;
@group(1) var flat_details: texture_2d<u32>;
@group(1) var flat_triangles: texture_2d<u32>;
@group(1) var materials: texture_2d<u32>;
@group(1) var texels: texture_2d<u32>;

const STACK: u32 = {{ stack }}u;

fn node_texel(index: u32) -> vec4u { return textureLoad(bvh_nodes, texel_at(index), 0); }
fn corner_texel(index: u32) -> vec4u { return textureLoad(triangle_corners, texel_at(index), 0); }

struct Ray { origin: vec3f, direction: vec3f, inverse: vec3f, octant4: u32 }

fn ray_from(origin: vec3f, direction: vec3f) -> Ray {
    // With the sign of the direction, by which near planes are chosen.
    let least = select(vec3f(1e-20), vec3f(-1e-20), direction < vec3f(0.0));
    let steep = select(direction, least, abs(direction) < vec3f(1e-20));
    let octant = select(4u, 0u, direction.x < 0.0) | select(2u, 0u, direction.y < 0.0) | select(1u, 0u, direction.z < 0.0);
    return Ray(origin, direction, 1.0 / steep, octant * 0x01010101u);
}

fn byte(word: u32, place: u32) -> f32 { return f32((word >> place) & 255u); }

// The children that a ray meets: inner ones as bits 24 to 31 in the order of their distance, triangles below.
struct Node { first_child: u32, first_triangle: u32, inner: u32, hits: u32 }

fn visit(index: u32, ray: Ray, t_max: f32) -> Node {
    let n0 = node_texel(index * 5u);
    let n1 = node_texel(index * 5u + 1u);
    let n2 = node_texel(index * 5u + 2u);
    let n3 = node_texel(index * 5u + 3u);
    let n4 = node_texel(index * 5u + 4u);
    let exponents = vec3u(n0.w, n0.w >> 8u, n0.w >> 16u) & vec3u(255u);
    let slope = bitcast<vec3f>(exponents << vec3u(23u)) * ray.inverse;
    let start = (bitcast<vec3f>(n0.xyz) - ray.origin) * ray.inverse;
    let back = ray.direction < vec3f(0.0);
    let near_x = select(n2.xy, n2.zw, back.x);
    let far_x = select(n2.zw, n2.xy, back.x);
    let near_y = select(n3.xy, n3.zw, back.y);
    let far_y = select(n3.zw, n3.xy, back.y);
    let near_z = select(n4.xy, n4.zw, back.z);
    let far_z = select(n4.zw, n4.xy, back.z);
    let inner = (n1.zw & (n1.zw << vec2u(1u))) & vec2u(0x10101010u);
    let places = (n1.zw ^ (vec2u(ray.octant4) & ((inner >> vec2u(4u)) * 255u))) & vec2u(0x1f1f1f1fu);
    let bits = (n1.zw >> vec2u(5u)) & vec2u(0x07070707u);
    var hits = 0u;
{% for child in range(8) %}
    {
        let enter = max(
            max(byte(near_x[{{ child // 4 }}], {{ child % 4 * 8 }}u) * slope.x + start.x, byte(near_y[{{ child // 4 }}], {{ child % 4 * 8 }}u) * slope.y + start.y),
            max(byte(near_z[{{ child // 4 }}], {{ child % 4 * 8 }}u) * slope.z + start.z, 0.0),
        );
        let leave = min(
            min(byte(far_x[{{ child // 4 }}], {{ child % 4 * 8 }}u) * slope.x + start.x, byte(far_y[{{ child // 4 }}], {{ child % 4 * 8 }}u) * slope.y + start.y),
            min(byte(far_z[{{ child // 4 }}], {{ child % 4 * 8 }}u) * slope.z + start.z, t_max),
        );
        let met = ((bits[{{ child // 4 }}] >> {{ child % 4 * 8 }}u) & 7u) << ((places[{{ child // 4 }}] >> {{ child % 4 * 8 }}u) & 31u);
        hits |= select(0u, met, enter <= leave * BOX_SLACK);
    }
{% endfor %}
    return Node(n1.x, n1.y, n0.w >> 24u, hits);
}

// Nearer than `t` at barycentric coordinates of the second and third corner.
struct Crossing { t: f32, second: f32, third: f32, met: bool, front: bool, corners: vec3u }

fn taxicab(v: vec3f) -> f32 { return abs(v.x) + abs(v.y) + abs(v.z); }

// By the signs of three volumes, each of one edge and the ray: neighbours that share an edge compute the same
// number with the other sign, so that no ray passes between two of them; and with room for rounding, so that none
// passes where many meet.
fn cross_triangle(slot: u32, ray: Ray, t_max: f32) -> Crossing {
    let c0 = corner_texel(slot * 3u);
    let c1 = corner_texel(slot * 3u + 1u);
    let c2 = corner_texel(slot * 3u + 2u);
    let a = bitcast<vec3f>(c0.xyz) - ray.origin;
    let b = bitcast<vec3f>(c1.xyz) - ray.origin;
    let c = bitcast<vec3f>(c2.xyz) - ray.origin;
    let from_b = dot(cross(c - a, c + a), ray.direction);
    let from_c = dot(cross(a - b, a + b), ray.direction);
    let from_a = dot(cross(b - c, b + c), ray.direction);
    let least = min(min(from_a, from_b), from_c);
    let greatest = max(max(from_a, from_b), from_c);
    // Against the front's normal, so that `along` is positive where the front is met.
    let normal = cross(a - b, c - a);
    let along = dot(normal, ray.direction);
    let t = dot(a, normal) / select(along, 1e-30, along == 0.0);
    let sum = from_a + from_b + from_c;
    let share = 1.0 / select(sum, 1e-30, sum == 0.0);
    let reach = max(max(taxicab(a), taxicab(b)), taxicab(c));
    let slack = EDGE_ROUNDINGS * reach * max(taxicab(c - a), taxicab(a - b)) * taxicab(ray.direction);
    // A triangle seen edge-on is no more than rounding.
    let met = (least >= -slack || greatest <= slack) && abs(sum) > 2.0 * slack && along != 0.0 && t > 0.0 && t < t_max;
    return Crossing(t, from_b * share, from_c * share, met, along > 0.0, vec3u(c0.w, c1.w, c2.w));
}

struct Todo { first_child: u32, hits: u32 }

fn is_done(todo: Todo) -> bool { return todo.hits <= 0x00ffffffu; }

// The number among the nodes of the nearest child that is still to be visited.
fn nearest_child(todo: Todo, ray: Ray) -> u32 {
    let slot = (firstLeadingBit(todo.hits) - 24u) ^ (ray.octant4 & 255u);
    return todo.first_child + countOneBits(todo.hits & ~(NOTHING << slot));
}

fn without_nearest(todo: Todo) -> Todo {
    return Todo(todo.first_child, todo.hits & ~(1u << firstLeadingBit(todo.hits)));
}

const ROOT: Todo = Todo(0u, 0x80000000u);
{% if alpha_tested or primary or glass %}
{% include "rays/material.wgsl" %}
{% endif %}
{% if glass %}
{% include "rays/glass.wgsl" %}

// Surfaces that light goes through are not met by `closest`.
var<private> ignores_glass: bool = false;
{% endif %}
{% if alpha_tested %}
{% if mapped and not from_eye %}

// A pixel's side across the ray where it begins, and its growth in a metre.
var<private> cone_side_m: f32 = 1.0;
var<private> cone_spread: f32 = 0.0;
{% endif %}

fn is_there(slot: u32, crossing: Crossing) -> bool {
    let triangle = textureLoad(flat_triangles, texel_at(slot), 0);
    let at = attributes_at(crossing);
    var cutoff = bitcast<f32>(material_texel(triangle.z, 1u).w);
{% if mapped %}
    let side_m = {{ "crossing.t * camera.footprint" if from_eye else "abs(cone_side_m + crossing.t * cone_spread)" }};
    cutoff = select(cutoff, hashed_cutoff(at.place_m, side_m), (triangle.w & ALPHA_HASHED) != 0u);
{% endif %}
    return base_color(triangle.z, at, vec2f(0.0)).a >= cutoff;
}
{% endif %}

// Triangles block rays whichever way they face{% if glass %}, but glass, which leaves a share of them: `passed_linear`{% endif %}.
fn is_blocked(ray: Ray, t_max: f32) -> bool {
{%- if glass %}
    passed_linear = vec3f(1.0);
    absorbed = vec3f(0.0);
{%- endif %}
    var stack: array<Todo, STACK>;
    var height = 0u;
    var todo = ROOT;
    var blocked = false;
    for (; !is_done(todo) && !blocked;) {
        let child = nearest_child(todo, ray);
        let rest = without_nearest(todo);
        if !is_done(rest) {
            stack[height] = rest;
            height += 1u;
        }
        let node = visit(child, ray, t_max);
        todo = Todo(node.first_child, (node.hits & 0xff000000u) | node.inner);
        for (var triangles = node.hits & 0x00ffffffu; triangles != 0u && !blocked; triangles &= triangles - 1u) {
            let slot = node.first_triangle + firstTrailingBit(triangles);
            let crossing = cross_triangle(slot, ray, t_max);
            blocked = crossing.met;
{% if alpha_tested %}
            for (var masked = crossing.met && (crossing.corners.x & ALPHA_TESTED) != 0u; masked; masked = false) {
                blocked = is_there(slot, crossing);
            }
{% endif %}
{% if glass %}
            for (var passes = blocked && (crossing.corners.x & GLASS) != 0u; passes; passes = false) {
                pass_straight(slot, crossing, ray.direction);
                blocked = false;
            }
{% endif %}
        }
        if is_done(todo) && height > 0u {
            height -= 1u;
            todo = stack[height];
        }
    }
{%- if glass %}
    passed_linear *= exp(-max(absorbed, vec3f(0.0)));
{%- endif %}
    return blocked;
}
{% if primary %}

struct Hit { t: f32, slot: u32, crossing: Crossing }

// The nearest triangle between two places; backs of single-sided ones are not there.
fn closest(ray: Ray, near: f32, far: f32) -> Hit {
    var stack: array<Todo, STACK>;
    var height = 0u;
    var todo = ROOT;
    var hit = Hit(far, NOTHING, Crossing(0.0, 0.0, 0.0, false, false, vec3u(0u)));
    for (; !is_done(todo);) {
        let child = nearest_child(todo, ray);
        let rest = without_nearest(todo);
        if !is_done(rest) {
            stack[height] = rest;
            height += 1u;
        }
        let node = visit(child, ray, hit.t);
        todo = Todo(node.first_child, (node.hits & 0xff000000u) | node.inner);
        for (var triangles = node.hits & 0x00ffffffu; triangles != 0u; triangles &= triangles - 1u) {
            let slot = node.first_triangle + firstTrailingBit(triangles);
            var crossing = cross_triangle(slot, ray, hit.t);
            let faces = crossing.front || (crossing.corners.x & DOUBLE_SIDED) != 0u;
            var met = crossing.met && faces && crossing.t > near;
{%- if glass %}
            met = met && !(ignores_glass && (crossing.corners.x & GLASS) != 0u);
{%- endif %}
{% if alpha_tested %}
            for (var masked = met && (crossing.corners.x & ALPHA_TESTED) != 0u; masked; masked = false) {
                met = is_there(slot, crossing);
            }
{% endif %}
            hit = Hit(select(hit.t, crossing.t, met), select(hit.slot, slot, met), pick_crossing(hit.crossing, crossing, met));
        }
        if is_done(todo) && height > 0u {
            height -= 1u;
            todo = stack[height];
        }
    }
    return hit;
}

fn pick_crossing(a: Crossing, b: Crossing, second: bool) -> Crossing {
    return Crossing(
        select(a.t, b.t, second), select(a.second, b.second, second), select(a.third, b.third, second), second,
        select(a.front, b.front, second), select(a.corners, b.corners, second),
    );
}
{% endif %}
