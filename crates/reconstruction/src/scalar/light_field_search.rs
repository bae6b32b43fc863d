//! Twin of `light_field_search.wgsl`: Lages §4.2.

use depth_image::ProvenanceKind;
use glam::{UVec2, Vec2, Vec3, Vec3Swizzles};

use super::{pixel::Pixel, sample_camera::SampleCamera, surface::bilinear_shares, view_ray::ViewRay};
use crate::{
    methods::light_field_search::BISECTIONS,
    pyramid::HOLE_CODE,
    view_work::{CELL_MARGIN_PX, FAR_AWAY},
};

/// `entered`: the point is inside for every camera that sees it; `seen`: some camera does.
struct Evaluation {
    entered: bool,
    seen: bool,
}

pub(super) fn light_field_search(cameras: &[SampleCamera], ray: &ViewRay, start: f32, steps: u32) -> Pixel {
    if ray.near > ray.far {
        return Pixel::without_surface(ProvenanceKind::Empty);
    }
    let stride = (ray.far - ray.near) / steps as f32;
    // The last step that is proven free need not be taken.
    let first_step = ((start - ray.near) / stride).floor().max(0.0).min(steps as f32) as u32;
    let mut entered = false;
    let mut never_unseen = true;
    let mut t = ray.near;
    for step in first_step..=steps {
        t = ray.near + stride * step as f32;
        let v = evaluate_cameras(cameras, ray, t);
        never_unseen &= v.seen;
        entered = v.entered;
        if entered {
            break;
        }
    }
    let mut low = (t - stride).max(ray.near);
    let mut high = t;
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if evaluate_cameras(cameras, ray, middle).entered {
            high = middle;
        } else {
            low = middle;
        }
    }
    let missed = if never_unseen { ProvenanceKind::Empty } else { ProvenanceKind::Filled };
    let found = if entered { most_conservative(cameras, ray, high) } else { None };
    match found {
        Some(camera) => Pixel::hit(color(camera, ray, high), high, camera.mask),
        None => Pixel::without_surface(missed),
    }
}

/// In inverse metres, positive inside; `None` where the camera does not see the point.
fn penetration(camera: &SampleCamera, ray: &ViewRay, t: f32) -> Option<f32> {
    let p = in_image(camera, ray, t);
    let uv = p.xy() / p.z;
    let seen = p.z > 0.0 && uv.cmpge(Vec2::splat(0.5)).all() && uv.cmple(camera.cells + 0.49).all();
    let code = seen.then(|| camera.code_at(uv.as_uvec2())).filter(|&code| code != HOLE_CODE)?;
    let penetration = camera.inverse_depth_per_m(f32::from(code)) - p.z.recip();
    // The space before a sample whose ray passed other surfaces is not seen.
    (penetration >= 0.0 || !camera.is_uncertain(uv.as_uvec2())).then_some(penetration)
}

fn in_image(camera: &SampleCamera, ray: &ViewRay, t: f32) -> Vec3 {
    let [a, b] = ray.in_image_of(camera);
    a + b * t
}

fn evaluate_cameras(cameras: &[SampleCamera], ray: &ViewRay, t: f32) -> Evaluation {
    let depths: Vec<f32> = cameras.iter().filter_map(|camera| penetration(camera, ray, t)).collect();
    let seen = !depths.is_empty();
    Evaluation { entered: seen && depths.iter().all(|&depth| depth >= 0.0), seen }
}

/// The camera whose surface is closest.
fn most_conservative<'c>(cameras: &'c [SampleCamera], ray: &ViewRay, t: f32) -> Option<&'c SampleCamera> {
    let mut closest = (FAR_AWAY, None);
    for camera in cameras {
        let depth = penetration(camera, ray, t).unwrap_or(FAR_AWAY);
        if depth < closest.0 {
            closest = (depth, Some(camera));
        }
    }
    closest.1
}

/// Bilinear between samples.
fn color(camera: &SampleCamera, ray: &ViewRay, t: f32) -> Vec3 {
    let p = in_image(camera, ray, t);
    let uv = (p.xy() / p.z - 0.5).max(Vec2::ZERO).min(camera.cells - CELL_MARGIN_PX);
    let cell = uv.as_uvec2();
    let at = uv - uv.floor();
    // Holes have no colour.
    let corners = (0..4u32).map(|i| cell + UVec2::new(i & 1, i >> 1)).zip(bilinear_shares(at));
    let held = corners.filter(|(texel, _)| camera.code_at(*texel) != HOLE_CODE);
    let (sum, shares) = held.fold((Vec3::ZERO, 0.0), |(sum, shares), (texel, share)| {
        (sum + camera.color_linear(texel) * share, shares + share)
    });
    sum / shares.max(1e-6)
}
