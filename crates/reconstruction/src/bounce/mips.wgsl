// Colours of rays that cover several texels, from the coarser levels that mips.rs makes.

// Of one level above the image's own, around a place in the image.
fn mip_color(camera: SampleCamera, level: u32, place_px: vec2f) -> vec3f {
    var first = camera.first_mip;
    var size_px = (vec2u(camera.cells) + 2u) / 2u;
    for (var finer = 1u; finer < level; finer++) {
        first += size_px.x * size_px.y;
        size_px = (size_px + 1u) / 2u;
    }
    let uv = clamp(place_px / exp2(f32(level)) - 0.5, vec2f(0.0), vec2f(size_px - 1u) - CELL_MARGIN_PX);
    let cell = vec2u(uv);
    return mixed_color(first + cell.y * size_px.x + cell.x, bilinear_shares(uv - floor(uv)));
}

// `color` is that of a ray without width. Interpolation is a tent two texels wide, so that a level's texels have half the ray's
// width. A loop that no ray enters costs nothing, unlike a branch.
fn filtered(camera: SampleCamera, color: vec3f, place_px: vec2f, width_texels: f32) -> vec3f {
    let shorter = u32(min(camera.cells.x, camera.cells.y));
    let coarsest = select(0u, firstLeadingBit(shorter), camera.first_mip > 0u);
    let level = min(log2(max(0.5 * width_texels, 1.0)), f32(coarsest));
    let below = u32(level);
    var mean = color;
    for (var coarse = below > 0u; coarse; coarse = false) { mean = mip_color(camera, below, place_px); }
    for (var between = level > f32(below); between; between = false) {
        mean = mix(mean, mip_color(camera, below + 1u, place_px), level - f32(below));
    }
    return mean;
}
