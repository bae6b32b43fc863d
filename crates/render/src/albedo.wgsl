// Diffuse reflectance in ten bits a channel, sRGB-encoded, so that eight-bit colours come back as they were; and
// whether light is no matter.
const SHOWN_AS_IT_IS: u32 = 0x40000000u;
// The surface's second word is the share of the environment's light that arrives, not emission.
const OCCLUDED: u32 = 0x80000000u;

fn packed_albedo(linear: vec3f, unlit: bool) -> u32 {
    let codes = vec3u(srgb_from_linear(linear) * 1023.0 + 0.5);
    return codes.r | (codes.g << 10u) | (codes.b << 20u) | select(0u, SHOWN_AS_IT_IS, unlit);
}

fn albedo_linear(word: u32) -> vec3f {
    return linear_from_srgb(vec3f(vec3u(word, word >> 10u, word >> 20u) & vec3u(1023u)) / 1023.0);
}
