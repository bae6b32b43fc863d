// Pixel redundancy (Xie, Algorithm 3): the image before holds, at the very pixel, a sample of the same triangle.

fn is_known(candidate: Candidate, number: u32, camera: KnownCamera) -> bool {
    let p = homogeneous_in(camera, candidate.point_in_world);
    var same = false;
    for (var look = is_in_view(camera, p); look; look = false) {
        let held = textureLoad(known_samples, vec2u(p.xy / p.z), number, 0);
        same = held.x != 0u && all(held.zw == candidate.id);
    }
    return same;
}
