// A point of a surface from which rays of light begin: above it by `bias_m`.
struct Spot { point: vec3f, normal: vec3f, origin: vec3f, bias_m: f32, seed: u32 }
