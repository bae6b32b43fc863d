// Rays begin above the surface by this share of the pixel's footprint on it: less than can be seen, more than the
// rounding of the point.
const BIAS_FOOTPRINTS: f32 = 0.015625;
// Rays also begin higher by the rounding of coordinates, relative to the greatest.
const BIAS_ROUNDINGS: f32 = 4e-7;

struct Spot { point: vec3f, normal: vec3f, origin: vec3f, bias_m: f32, seed: u32 }
