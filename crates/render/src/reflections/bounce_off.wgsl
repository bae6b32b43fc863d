// Rays off mirrors, which are listed to be followed.
@group(0) var<storage, read_write> next_bounces: array<Bounce>;
struct NextList { workgroups: atomic<u32>, y: u32, z: u32, count: atomic<u32> }
@group(0) var<storage, read_write> next: NextList;

// Lists a ray, if it brings anything.
fn list_bounce(bounce: Bounce) {
    let share = bounce.throughput_linear;
    if max(max(share.r, share.g), share.b) <= 0.0 { return; }
    let entry = atomicAdd(&next.count, 1u);
    if entry % LIST_WORKGROUP == 0u { atomicAdd(&next.workgroups, 1u); }
    next_bounces[entry] = bounce;
}

// Lists the ray off a mirror, if it is one. `arriving` has the pixel's place, the throughput to the mirror, the point
// and the footprint there, and the mirror's curvature.
fn bounce_off(mirror: Mirror, arriving: Bounce) {
    let share = mirror_share(mirror.reflector.roughness);
    let throughput_linear = arriving.throughput_linear * environment_reflectance(mirror) * share;
    // The normal turns by the curvature over the footprint, and the ray by twice as much: ray cones, for the mean of both
    // directions.
    let spread = arriving.spread + 2.0 * arriving.curvature_per_m * arriving.side_m;
    list_bounce(Bounce(
        mirror.point_in_world + mirror.normal * arriving.bias_m, arriving.place,
        reflect(-mirror.towards_eye, mirror.normal), hashed(arriving.seed ^ 0x68bc21ebu),
        throughput_linear, arriving.side_m, vec4u(0u), arriving.bias_m, spread, mirror.reflector.roughness, 0.0, 0u,
        arriving.near_m, 0u,
    ));
}
