// Pixel redundancy (Xie, Algorithm 3): the image before holds, at the very pixel, a sample of the same triangle.

fn is_redundant_with(candidate: Candidate, number: u32, camera: KnownCamera) -> bool {
    let p = homogeneous_in(camera, candidate);
    // A load costs less than a branch around it.
    let held = textureLoad(known_samples, nearest_texel(camera, p), number, 0).xy;
    return is_in_view(camera, p) && all(held == candidate.id);
}
