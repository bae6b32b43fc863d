// Hashed alpha testing (Wyman and McGuire 2017): a surface is there where its alpha is not below a hash of the place, so
// that its alpha is the share of places where it is. The hash is of a cell of space that is about as large as a pixel and
// moves with the mesh. Two sizes, powers of two, are mixed by the pixel's own, here linearly. The twin is
// scalar/hashed_alpha.rs.

// The hash of a cell, 0 to 1 (pcg3d of Jarzynski and Olano 2020).
fn hash_of_cell(cell: vec3i) -> f32 {
    var v = bitcast<vec3u>(cell) * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> vec3u(16u);
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return f32(v.z >> 8u) * 5.9604645e-8;
}

// The alpha below which a place in the mesh's space, in metres of the world, is not there; for pixels of this side on the
// surface. Equally spread over 0 to 1.
fn hashed_cutoff(place_m: vec3f, side_m: f32) -> f32 {
    let cells_per_m = 1.0 / clamp(side_m, 1e-20, 1e20);
    let coarse = bitcast<f32>(bitcast<u32>(cells_per_m) & 0x7f800000u);
    let share = cells_per_m / coarse - 1.0;
    let low = hash_of_cell(vec3i(floor(place_m * coarse)));
    let high = hash_of_cell(vec3i(floor(place_m * (2.0 * coarse))));
    // The mix of two equally spread numbers is not equally spread: its own distribution makes it so.
    let x = mix(low, high, share);
    let a = max(min(share, 1.0 - share), 1e-6);
    let sides = 2.0 * a * (1.0 - a);
    let middle = select((x - 0.5 * a) / (1.0 - a), 1.0 - (1.0 - x) * (1.0 - x) / sides, x > 1.0 - a);
    return clamp(select(middle, x * x / sides, x < a), 1e-6, 1.0);
}
