// Pixels of a sample image whose light views find in an image before it. They become holes; all others are listed, to be lit. The twin
// is scalar/coverage.rs.
{% include "camera.wgsl" %}
{% include "normal.wgsl" %}
{% include "table.wgsl" %}
{% include "surfaces.wgsl" %}
{% include "lamp_shares.wgsl" %}
{% include "cached_texels.wgsl" %}
{% include "footprint.wgsl" %}
{% include "pixel_list.wgsl" %}

// 1 for pixels that keep their samples.
@group(0) var<storage, read_write> kept: array<u32>;
{%- if sum_planes %}
@group(0) var<storage, read_write> sums: array<f32>;
{%- endif %}

// Whether all four texels around a point's place in an image lie on the surface. They are a texel or more from the image's border.
fn is_surrounded(image: CacheCamera, point: Point) -> bool {
    let at = vec4f(point.offset, 1.0);
    let rows = image.homogeneous_texel_from_offset;
    let depth_m = dot(rows[2], at);
    let place = vec2f(dot(rows[0], at), dot(rows[1], at)) / depth_m;
    let size = vec2f(image.size_px);
    let low = floor(place - 0.5);
    let plane_m = cache.tests.plane_footprints * max(depth_m * image.footprint, point.footprint_m);
    var is_on_surface = depth_m > image.near_m && all(low >= vec2f(1.0)) && all(low < size - 2.0);
    for (var corner = 0u; corner < 4u && is_on_surface; corner++) {
        let texel = vec2u(low) + vec2u(corner & 1u, corner >> 1u);
        let first = (image.first_sample + texel.y * image.size_px.x + texel.x) * SAMPLE_TEXELS;
        let sight = sight_of(image, point, vec2f(texel) + 0.5);
        is_on_surface = texel_beside(sight, first, sight.direction, 1.0, point, plane_m, 0.0).weight > 0.0;
    }
    return is_on_surface;
}

// Whether an image before knows the light of the point and of all around it: at the corners of a square that reaches a pixel to each
// side on the triangle's plane. There it is not much coarser.
fn is_covered(point: Point) -> bool {
    let normal = point.triangle_normal;
    let own_m = stretched_footprint(1.0, point.footprint_m, normal, point.offset);
    // Head-on, any two directions do.
    let across = cross(normal, normalize(point.offset) + camera.column_in_world * (1e-3 / camera.footprint));
    let aside = across * (point.footprint_m * inverseSqrt(max(dot(across, across), 1e-30)));
    let along = cross(normal, aside) * (own_m / point.footprint_m);
    var covered = false;
    for (var number = 0u; number < cache.camera_count && !covered; number++) {
        let image = cache.cameras[number];
        let depth_m = dot(image.homogeneous_texel_from_offset[2], vec4f(point.offset, 1.0));
        let held_m = stretched_footprint(depth_m, image.footprint, normal, point.offset - image.eye_offset);
        covered = held_m <= MOST_COARSER * own_m;
        for (var corner = 0u; corner < 4u && covered; corner++) {
            var around = point;
            around.offset += select(-aside, aside, (corner & 1u) == 1u) + select(-along, along, corner >= 2u);
            covered = is_surrounded(image, around);
        }
    }
    return covered;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = pixel_at(id);
    if is_beyond(pixel) { return; }
    let place = place_of(pixel);
    let depth = reversed_depth_at(pixel);
    var is_kept = false;
    for (var met = depth > 0.0; met; met = false) {
        is_kept = !is_covered(point_at(pixel, camera.near_m / depth, surface_at(pixel)));
    }
    kept[camera.first_word / {{ plane_count }}u + place] = select(0u, 1u, is_kept);
    if is_kept {
        list_pixel(place);
        return;
    }
{%- if sum_planes %}
    for (var plane = 0u; plane < {{ sum_planes }}u; plane++) { sums[camera.first_sum + plane * camera.pixel_count + place] = 0.0; }
{%- endif %}
}
