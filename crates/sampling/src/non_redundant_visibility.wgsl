// Visibility redundancy (Xie, Algorithm 2): the first thing on the way from the other viewpoint is the sample
// itself. Outside of that camera's view nothing is redundant with it.

// What the point may be off by: parts of its depth, and of the pixel's length on the surface.
const SAME_DEPTH: f32 = 2e-5;
const SAME_FOOTPRINTS: f32 = 0.0625;

fn is_known(candidate: Candidate, number: u32, camera: KnownCamera) -> bool {
    let p = homogeneous_in(camera, candidate);
    var first = false;
    for (var look = is_in_view(camera, p); look; look = false) {
        let room = SAME_DEPTH * p.z + SAME_FOOTPRINTS * candidate.footprint_m;
        // Planar depth is the ray's parameter, as everywhere.
        let way = ray_from(camera.eye_in_world, (candidate.point_in_world - camera.eye_in_world) / p.z);
        let met = closest(way, camera.near_m, p.z + room);
        first = met.slot != NOTHING && met.t >= p.z - room;
    }
    return first;
}
