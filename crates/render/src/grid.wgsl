{# The regular grid of places on a lamp, and which of them each point sees. -#}
// The place of the `number`-th ray of a grid: neighbouring numbers are far apart, so that any run of them covers the lamp.
fn grid_place(number: u32) -> vec2f {
    let point = number * camera.grid_stride % camera.grid_count;
    return (vec2f(vec2u(point % camera.grid_side, point / camera.grid_side)) + 0.5) / f32(camera.grid_side);
}
{% if bits %}

// A bit for each ray of the grid on each lamp, pixel after pixel: whether the pixel's surface sees the ray's place.
@group(0) var<storage, {{ "read_write" if writes_bits else "read" }}> lamp_bits: array<u32>;

// The number of a ray's bit among those of a pixel and lamp.
fn bit_of(number: u32) -> u32 { return number % camera.grid_count; }

// Where the words of a pixel and lamp begin.
fn first_bit_word(place: u32, lamp: u32) -> u32 {
    let words = (camera.grid_count + 31u) / 32u;
    return ((camera.first_pixel + place) * illumination.light_count + lamp) * words;
}
{% endif %}
