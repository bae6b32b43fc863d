// Pixels that a pass finds surfaces for: where they are listed, and what is found.

// Linear, as RGB9E5; the colour of the background is added later.
@group(0) var<storage, read_write> out_color: array<u32>;
@group(0) var<storage, read_write> out_inverse_depth: array<f32>;
@group(0) var<storage, read_write> out_provenance: array<u32>;
// Pixels that the next pass takes up, as it reads them with pixel_list.wgsl.
@group(0) var<storage, read_write> undecided_pixels: array<u32>;
struct UndecidedList { workgroups: atomic<u32>, y: u32, z: u32, count: atomic<u32> }
@group(0) var<storage, read_write> undecided: array<UndecidedList>;

// Leaves a pixel to the next pass.
fn leave_undecided(index: u32) {
    let place = atomicAdd(&undecided[work.view.number].count, 1u);
    undecided_pixels[first_listed() + place] = index;
    if place % LIST_WORKGROUP == 0u { atomicAdd(&undecided[work.view.number].workgroups, 1u); }
}

struct Pixel { index: u32, tile: u32, direction: vec3f }

fn pixel_of(id: vec2u) -> Pixel {
    let tiles_across = (work.view.size_px.x + TILE_PX - 1u) / TILE_PX;
    let center = vec2f(id) + 0.5;
    let direction = work.view.column_in_world * center.x + work.view.row_in_world * center.y + work.view.corner_in_world;
    let index = work.view.first_pixel + id.y * work.view.size_px.x + id.x;
    let tile = work.view.first_tile + (id.y / TILE_PX) * tiles_across + id.x / TILE_PX;
    return Pixel(index, tile, direction);
}

// A hit's provenance but for its kind.
fn origin_of(mask: u32, split: u32) -> u32 { return (mask << 8u) | (split << SPLIT_SHIFT); }

fn write_pixel(index: u32, color_rgb9e5: u32, inverse_depth_per_m: f32, provenance: u32) {
    out_color[index] = color_rgb9e5;
    out_inverse_depth[index] = inverse_depth_per_m;
    out_provenance[index] = provenance;
}

// Writes the surface that was found at t, or what is where none was; `empty`: nothing is there.
fn write_found(index: u32, found: bool, t: f32, color_linear: vec3f, origin: u32, empty: bool) {
    let missed = select(PROVENANCE_FILLED, PROVENANCE_EMPTY, empty);
    let provenance = select(missed, PROVENANCE_HIT | origin, found);
    let color = select(0u, rgb9e5_from_linear(color_linear), found);
    write_pixel(index, color, select(0.0, 1.0 / t, found), provenance);
    if provenance == PROVENANCE_FILLED { leave_undecided(index); }
}
