//! Twin of `quads/draw.wgsl` and `quads/resolve.wgsl`: triangles met by rays, then coloured by all cameras.

use depth_image::{DepthImage, PinholeCamera, ProvenanceKind, linear_from_rgb9e5};
use glam::{UVec2, Vec2, Vec3, Vec3Swizzles};

use super::{
    pixel::Pixel,
    sample_camera::SampleCamera,
    surface,
    view_ray::{ViewRay, ViewRays, places},
};
use crate::{pyramid::BACKGROUND_CODE, quads::Quad};

/// The nearest triangle of a pixel.
#[derive(Clone, Copy)]
struct Drawn {
    t: f32,
    image: usize,
    sample: u32,
}

/// Row by row.
pub(super) fn drawn(
    quads: &[Quad],
    images: &[DepthImage],
    cameras: &[SampleCamera],
    view: &PinholeCamera,
    rays: &ViewRays,
) -> Vec<Pixel> {
    let mut nearest = vec![None; view.pixel_count()];
    for quad in quads {
        let [a, b, c, d] = quad.corners_in_world;
        for (triangle, sample) in [[a, b, c], [d, c, b]].into_iter().zip(quad.samples) {
            draw(&mut nearest, view, rays, triangle, quad.image, sample);
        }
    }
    let pixels = rays.places().zip(nearest).map(|(place, drawn)| match drawn {
        Some(drawn) => resolved(drawn, images, cameras, &rays.ray(place)),
        None => Pixel::without_surface(kind_of_nothing(cameras, &rays.ray(place))),
    });
    pixels.collect()
}

fn draw(
    nearest: &mut [Option<Drawn>],
    view: &PinholeCamera,
    rays: &ViewRays,
    triangle: [Vec3; 3],
    image: usize,
    sample: u32,
) {
    let [low, high] = bounds_px(view, triangle);
    for place in places(high - low).map(|place| low + place) {
        let slot = &mut nearest[(place.y * view.size_px.x + place.x) as usize];
        let farthest = slot.map_or(f32::INFINITY, |drawn: Drawn| drawn.t);
        if let Some(t) = meets(&rays.ray(place), triangle).filter(|&t| t >= view.near_m && t < farthest) {
            *slot = Some(Drawn { t, image, sample });
        }
    }
}

/// Pixels that a triangle may cover: all where it reaches behind the eye.
fn bounds_px(view: &PinholeCamera, triangle: [Vec3; 3]) -> [UVec2; 2] {
    let size = view.size_px.as_vec2();
    let mut low = Vec2::MAX;
    let mut high = Vec2::MIN;
    for point in triangle {
        let Some(seen) = view.project(point).filter(|seen| seen.planar_depth_m > view.near_m) else {
            return [UVec2::ZERO, view.size_px];
        };
        low = low.min(seen.pixel);
        high = high.max(seen.pixel);
    }
    [(low - 1.0).clamp(Vec2::ZERO, size).as_uvec2(), (high + 1.0).clamp(Vec2::ZERO, size).as_uvec2()]
}

/// The ray's parameter at a triangle, from either side.
fn meets(ray: &ViewRay, [a, b, c]: [Vec3; 3]) -> Option<f32> {
    let ab = b - a;
    let ac = c - a;
    let across = ray.direction.cross(ac);
    let determinant = ab.dot(across);
    let from = ray.eye - a;
    let u = from.dot(across) / determinant;
    let along = from.cross(ab);
    let v = ray.direction.dot(along) / determinant;
    // Not a number where the ray lies in the plane.
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| ac.dot(along) / determinant)
}

fn resolved(drawn: Drawn, images: &[DepthImage], cameras: &[SampleCamera], ray: &ViewRay) -> Pixel {
    let blend = surface::blend_two_best(cameras, ray, drawn.t);
    if blend.camera_mask != 0 {
        return Pixel::hit(blend.color_linear, drawn.t, blend.camera_mask);
    }
    let own = linear_from_rgb9e5(images[drawn.image].color_rgb9e5[drawn.sample as usize]);
    Pixel::hit(own, drawn.t, 1 << drawn.image)
}

/// Empty where the ray misses the volume, or some camera sees the background where the ray leaves it.
fn kind_of_nothing(cameras: &[SampleCamera], ray: &ViewRay) -> ProvenanceKind {
    let point = ray.at(ray.far);
    if ray.near > ray.far || cameras.iter().any(|camera| shows_background(camera, point)) {
        return ProvenanceKind::Empty;
    }
    ProvenanceKind::Filled
}

fn shows_background(camera: &SampleCamera, point_in_world: Vec3) -> bool {
    let p = camera.homogeneous(point_in_world.extend(1.0));
    let uv = p.xy() / p.z;
    let inside = p.z > 0.0 && uv.cmpge(Vec2::ZERO).all() && uv.cmplt(camera.cells + 1.0).all();
    let texel = uv.min(camera.cells).as_uvec2();
    // Not where the ray passed what other images hold.
    inside && camera.code_at(texel) == BACKGROUND_CODE && !camera.is_uncertain(texel)
}
