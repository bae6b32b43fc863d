// One camera of a batch: its pixels' rays, and where its planes begin in what is shared by the batch.

struct PixelCamera {
    eye_in_world: vec3f,
    near_m: f32,
    // world direction of a pixel = column · x + row · y + corner; its parameter is planar depth in metres.
    column_in_world: vec3f,
    // A pixel's side on a surface that faces the camera, in metres at a depth of one metre.
    footprint: f32,
    row_in_world: vec3f,
    first_word: u32,
    corner_in_world: vec3f,
    first_sum: u32,
    size_px: vec2u,
    // The first pixel, from where the forward axis meets the image; wraps.
    first_from_axis: vec2u,
    pixel_count: u32,
    seed: u32,
    // Numbers of the rays that are traced now, and of all that the sums hold afterwards.
    first_shadow_ray: u32,
    shadow_rays: u32,
    first_ambient_ray: u32,
    ambient_rays: u32,
    shadow_rays_in_sum: u32,
    ambient_rays_in_sum: u32,
    occlusion_radius_m: f32,
    // This dispatch's rows of the picture: the first, a multiple of 8, and the one after the last.
    first_row: u32,
    end_row: u32,
    // This dispatch's lamps.
    first_light: u32,
    end_light: u32,
    // Places of the grid on each lamp, along a side and all, and how far its rays are apart among them.
    grid_side: u32,
    grid_count: u32,
    grid_stride: u32,
    // Pixels of the batch before the camera's.
    first_pixel: u32,
{%- if single_pole %}
    // The pixels that a point moves for each inverse metre of depth.
    bend_px_m: f32,
    pole_px: vec2f,
    farthest_m: f32,
{%- endif %}
}

@group(0) var<uniform> camera: PixelCamera;

// The pixel of an invocation over some rows. Beyond them where it has none.
fn pixel_at(id: vec3u) -> vec2u { return vec2u(id.x, id.y + camera.first_row); }

fn is_beyond(pixel: vec2u) -> bool { return pixel.x >= camera.size_px.x || pixel.y >= camera.end_row; }

{% if single_pole %}
{% include "single_pole.wgsl" %}
{%- else -%}
fn direction_of(pixel: vec2u) -> vec3f {
    let center = vec2f(pixel) + 0.5;
    return camera.column_in_world * center.x + camera.row_in_world * center.y + camera.corner_in_world;
}
{%- endif %}

fn place_of(pixel: vec2u) -> u32 { return pixel.y * camera.size_px.x + pixel.x; }
