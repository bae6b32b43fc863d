// Of each image: its samples have the inverse depth plane · (column, row, 1), if it is flat.
struct Plane { plane: vec3f, is_flat: f32 }
struct Planes { of_cameras: array<Plane, {{ cameras }}> }
@group(0) var<uniform> planes: Planes;

// Where a ray meets the plane of a flat image. The image sees this place and where the ray is now, so that the way in between is
// free. A ray that meets nothing so is to be marched.
fn march_flat(a: vec3f, b: vec3f, found: March, far: f32, camera: SampleCamera, plane: Plane) -> March {
    let near = found.t;
    let before = 1.0 - dot(plane.plane, a + b * near);
    let t = near + before * safe_reciprocal(dot(plane.plane, b));
    let p = a + b * t;
    var crossed = plane.is_flat > 0.0 && !found.crossed && sees(camera, a + b * near) && before > 0.0 && t > near && t < far && sees(camera, p);
    for (var shows = crossed; shows; shows = false) {
        let cell = vec2u(clamp(p.xy / p.z - 0.5, vec2f(0.0), camera.cells - CELL_MARGIN_PX));
        let corners = corners_of(camera.first_cell + cell.y * camera.width_px + cell.x);
        crossed = corners.connected && corners.codes.x >= FIRST_SAMPLE;
    }
    return March(select(near, t, crossed), crossed || found.crossed);
}
