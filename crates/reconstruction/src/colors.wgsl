// The colours of a cell's corners, in their order.
struct Colors { corners: array<vec3f, 4> }

fn colors_of(cell_index: u32) -> Colors {
    let left = textureLoad(cell_colors, texel_at(cell_index), 0).xy;
    let right = textureLoad(cell_colors, texel_at(cell_index + 1u), 0).xy;
    return Colors(array(
        linear_from_rgb9e5(left.x), linear_from_rgb9e5(right.x), linear_from_rgb9e5(left.y), linear_from_rgb9e5(right.y),
    ));
}
