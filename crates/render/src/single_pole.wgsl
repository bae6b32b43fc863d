// The rays of a single-pole occlusion camera, as those of SinglePoleCamera in depth-image.

// The way from the pole on which a pixel's points move, as long as they move for each inverse metre.
fn away_px_m(pixel: vec2u) -> vec2f {
    let from_pole = vec2f(pixel) + 0.5 - camera.pole_px;
    let distance_px = length(from_pole);
    let away = select(vec2f(1.0, 0.0), from_pole / max(distance_px, 1e-20), distance_px > 0.0);
    return away * camera.bend_px_m;
}

// Its parameter is planar depth in metres.
fn direction_of(pixel: vec2u) -> vec3f {
    let at = vec2f(pixel) + 0.5 - away_px_m(pixel) / camera.near_m;
    return camera.column_in_world * at.x + camera.row_in_world * at.y + camera.corner_in_world;
}

fn origin_of(pixel: vec2u) -> vec3f {
    let away = away_px_m(pixel);
    return camera.eye_in_world + camera.column_in_world * away.x + camera.row_in_world * away.y;
}

// The planar depth at which a pixel's ray ends: where it meets the axis of the pole, or where the camera sees no farther.
fn farthest_of(pixel: vec2u) -> f32 {
    let short_px = camera.bend_px_m / camera.near_m - length(vec2f(pixel) + 0.5 - camera.pole_px);
    return select(camera.farthest_m, min(camera.farthest_m, camera.bend_px_m / max(short_px, 1e-20)), short_px > 0.0);
}
