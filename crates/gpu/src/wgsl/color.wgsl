// Colour encodings; the twins of depth-image's encoding.rs.

fn linear_from_rgb9e5(packed: u32) -> vec3f {
    // The scale 2^(e - 24) is assembled as float bits.
    let scale = bitcast<f32>(((packed >> 27u) + 103u) << 23u);
    return vec3f(f32(packed & 511u), f32((packed >> 9u) & 511u), f32((packed >> 18u) & 511u)) * scale;
}

fn rgb9e5_from_linear(linear: vec3f) -> u32 {
    let c = clamp(linear, vec3f(0.0), vec3f(65408.0));
    let largest = max(max(c.r, c.g), c.b);
    let floor_log2 = max(i32(bitcast<u32>(largest) >> 23u) - 127, -16);
    var exponent = u32(floor_log2 + 16);
    // 2^(24 - exponent), as float bits.
    var scale = bitcast<f32>((151u - exponent) << 23u);
    if floor(largest * scale + 0.5) >= 512.0 {
        exponent += 1u;
        scale *= 0.5;
    }
    let q = vec3u(floor(c * scale + 0.5));
    return q.r | (q.g << 9u) | (q.b << 18u) | (exponent << 27u);
}

fn srgb_from_linear(linear: vec3f) -> vec3f {
    let c = clamp(linear, vec3f(0.0), vec3f(1.0));
    return select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, c * 12.92, c <= vec3f(0.0031308));
}

fn linear_from_srgb(encoded: vec3f) -> vec3f {
    return select(pow((encoded + 0.055) / 1.055, vec3f(2.4)), encoded / 12.92, encoded <= vec3f(0.04045));
}
