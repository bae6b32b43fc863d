// Planes of what has arrived so far, summed over rays: what a white surface reflects of all lamps and of the
// environment, three planes each, and how many rays reached the environment and each lamp.
const LAMPS: u32 = 0u;
const ENVIRONMENT: u32 = 3u;
const OPEN_TO_ENVIRONMENT: u32 = COLOR_SUMS;
const OPEN_TO_LAMPS: u32 = OPEN_TO_ENVIRONMENT + 1u;

fn sum_at(plane: u32, place: u32) -> f32 { return sums[camera.first_sum + plane * camera.pixel_count + place]; }

// The light of lamps on a white surface.
fn lamps_at(place: u32) -> vec3f {
    let sum = vec3f(sum_at(LAMPS, place), sum_at(LAMPS + 1u, place), sum_at(LAMPS + 2u, place));
    return sum / f32(camera.shadow_rays_in_sum);
}

// The light of the environment on a white surface.
fn environment_at(place: u32, open: f32) -> vec3f {
    let sum = vec3f(sum_at(ENVIRONMENT, place), sum_at(ENVIRONMENT + 1u, place), sum_at(ENVIRONMENT + 2u, place));
    return sum * (open / f32(camera.ambient_rays_in_sum));
}

// The light of a white surface at which this share of the environment's light arrives.
fn light_at(place: u32, open: f32) -> vec3f { return lamps_at(place) + environment_at(place, open); }
