// Depth peeling: everything up to the layer before. Where that has nothing there is nothing behind it either.

fn is_redundant_with(candidate: Candidate, number: u32, camera: KnownCamera) -> bool {
    let held = textureLoad(known_samples, candidate.pixel, number, 0);
    let depth = bitcast<f32>(held.x) * camera.near_m;
    return held.x == 0u || candidate.reversed_depth >= depth * (1.0 - SAME_LAYER);
}
