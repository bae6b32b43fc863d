// Images of single-pole occlusion cameras: see SinglePoleCamera in depth-image.

struct Pole {
    pole_px: vec2f,
    // The pixels that a point moves for each inverse metre of depth.
    bend_px_m: f32,
    // The inverse depths between which the camera sees.
    nearest_per_m: f32,
    farthest_per_m: f32,
    padding_0: f32,
    padding_1: f32,
    padding_2: f32,
}

// Of the cameras, in their order; and how the rays off mirrors are followed, in texels.
struct Poles { coarse_px: f32, fine_px: f32, padding_0: f32, padding_1: f32, cameras: array<Pole, {{ cameras }}> }

@group(0) var<uniform> poles: Poles;

// Where the pinhole's `uv` lies in the image, in pixels from its corner.
fn moved(pole: Pole, uv: vec2f, inverse_depth: f32) -> vec2f {
    let from_pole = uv - pole.pole_px;
    let away = from_pole * inverseSqrt(max(dot(from_pole, from_pole), 1e-12));
    return uv + away * (pole.bend_px_m * (pole.nearest_per_m - inverse_depth));
}
