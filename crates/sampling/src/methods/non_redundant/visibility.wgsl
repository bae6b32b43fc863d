// Visibility redundancy (Xie, Algorithm 2): the first thing on the way from the other viewpoint is the sample
// itself. Outside of that camera's view nothing is redundant with it.

fn is_redundant_with(candidate: Candidate, number: u32, camera: KnownCamera) -> bool {
    let p = homogeneous_in(camera, candidate);
    var first = false;
    for (var in_view = is_in_view(camera, p); in_view; in_view = false) {
        let room = SAME_DEPTH * p.z + SAME_FOOTPRINTS * candidate.footprint_m;
        // Planar depth is the ray's parameter, as everywhere.
        let way = ray_from(camera.eye_in_world, (candidate.point_in_world - camera.eye_in_world) / p.z);
        let met = closest(way, camera.near_m, p.z + room);
        first = met.slot != NOTHING && met.t >= p.z - room;
    }
    return first;
}
