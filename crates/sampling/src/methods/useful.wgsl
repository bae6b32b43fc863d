// The ring test of effective depth peeling says whether a sample behind redundant ones can be seen from the
// view cell. Seen from a viewpoint at the cell's rim the blocker moves aside by the ring's radius; where all of the ring shows
// the blocker, nothing behind it comes out.

// 0 beyond the image, where nothing is known.
fn front_around(pixel: vec2i) -> f32 {
    let inside = all(pixel >= vec2i(0)) && all(pixel < vec2i(camera.size_px));
    let texel = vec2u(clamp(pixel, vec2i(0), vec2i(camera.size_px) - 1));
    return select(0.0, front_at(texel), inside);
}

// The pixel's sample lies at `depth` behind a blocker at `blocker`; both depths are reversed.
fn is_useful(pixel: vec2u, depth: f32, blocker: f32) -> bool {
    let sample_m = camera.near_m / depth;
    let blocker_m = camera.near_m / blocker;
    let aside_m = finish.view_cell_m * (sample_m - blocker_m) / sample_m;
    let footprint_m = blocker_m * camera.footprint;
    let radius_px = max(aside_m / footprint_m, 1.0);
    var useful = false;
    for (var step = 0u; step < RING && !useful; step++) {
        let angle = f32(step) * (6.2831853 / f32(RING));
        let front = front_around(vec2i(floor(vec2f(pixel) + 0.5 + vec2f(cos(angle), sin(angle)) * radius_px)));
        useful = front <= 0.0 || abs(camera.near_m / max(front, 1e-30) - blocker_m) > BLOCKER_FOOTPRINTS * footprint_m;
    }
    return useful;
}
