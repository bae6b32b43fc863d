// Exposure and tone curve: a pixel's mean colour in linear light to the one that a screen shows; the twin of depth-image's
// tone.rs.

struct Tone {
    exposure_factor: f32,
    // 0: none, 1: Khronos PBR Neutral.
    curve: u32,
    padding: vec2u,
}

// The published function. A dielectric's reflectance at normal incidence is taken off, then peaks are compressed, and what
// is compressed turns white.
fn khronos_neutral(exposed: vec3f) -> vec3f {
    const DIELECTRIC = 0.04;
    const COMPRESSED_FROM = 0.8 - DIELECTRIC;
    const ROOM = 1.0 - COMPRESSED_FROM;
    const DESATURATION = 0.15;
    // Infinities are no colours.
    let color = clamp(exposed, vec3f(0.0), vec3f(1e9));
    let least = min(min(color.r, color.g), color.b);
    let based = color - select(DIELECTRIC, least - 0.25 / DIELECTRIC * least * least, least < 2.0 * DIELECTRIC);
    let peak = max(max(based.r, based.g), based.b);
    // No divisor is 0, whatever the colour.
    let compressed = max(peak, COMPRESSED_FROM);
    let new_peak = 1.0 - ROOM * ROOM / (compressed + ROOM - COMPRESSED_FROM);
    let whiteness = 1.0 - 1.0 / (DESATURATION * (compressed - new_peak) + 1.0);
    let white = mix(based * (new_peak / compressed), vec3f(new_peak), whiteness);
    return select(based, white, peak >= COMPRESSED_FROM);
}

fn shown_from_mean(mean: vec3f, tone: Tone) -> vec3f {
    let exposed = mean * tone.exposure_factor;
    var shown = exposed;
    // A loop, not a branch: the software device skips only loops that no lane needs.
    for (var mapped = tone.curve == 1u; mapped; mapped = false) { shown = khronos_neutral(exposed); }
    return shown;
}
