// Depth peeling: everything up to the layer before. Where that has nothing there is nothing behind it either.

// Layers are drawn from one place, and depths differ by rounding at most.
const SAME_DEPTH: f32 = 1e-6;

fn is_known(candidate: Candidate, number: u32, camera: KnownCamera) -> bool {
    let held = textureLoad(known_samples, candidate.pixel, number, 0);
    let depth = bitcast<f32>(held.x) * camera.near_m;
    return held.x == 0u || candidate.reversed_depth >= depth * (1.0 - SAME_DEPTH);
}
