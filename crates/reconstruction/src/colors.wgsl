// The colours of a cell's corners, in their order.
struct Colors { corners: array<vec3f, 4> }

fn colors_of(cell_index: u32) -> Colors {
    let left = textureLoad(cell_colors, texel_at(cell_index), 0).xy;
    let right = textureLoad(cell_colors, texel_at(cell_index + 1u), 0).xy;
    return Colors(array(
        linear_from_rgb9e5(left.x), linear_from_rgb9e5(right.x), linear_from_rgb9e5(left.y), linear_from_rgb9e5(right.y),
    ));
}

// The colour at a place inside a cell, by the shares of its corners.
fn mixed_color(cell_index: u32, shares: vec4f) -> vec3f {
    let colors = colors_of(cell_index).corners;
    return shares.x * colors[0] + shares.y * colors[1] + shares.z * colors[2] + shares.w * colors[3];
}
