//! The environment map behind reconstructed views: of each pixel's direction.

use std::sync::Arc;

use depth_image::{EnvironmentMap, ProvenanceKind, ViewPlanes, srgb8_from_linear};
use fixtures::uv_sphere;
use glam::{UVec2, Vec2, Vec3};
use gpu::{GpuEnvironment, Turn};
use reconstruction::{ReconstructionMethod, SetDescription};

use crate::stage::{CARVE, Corners, SEARCH, Stage, VIEW_PX, count, depths, gpu, reconstruct, reconstructor};

/// Colours that differ everywhere.
fn colorful() -> EnvironmentMap {
    let size_px = UVec2::new(64, 32);
    let texel = |i: u32| Vec3::new((i % 64) as f32 / 64.0, (i / 64) as f32 / 32.0, ((i * 7) % 13) as f32 / 13.0);
    let radiances: Vec<Vec3> = (0..size_px.element_product()).map(texel).collect();
    EnvironmentMap::new(size_px, &radiances).expect("a map")
}

#[test]
fn a_view_shows_the_map_in_each_direction_without_a_surface() {
    let map = colorful();
    let on_device = Arc::new(GpuEnvironment::upload(gpu(), &map).expect("a map"));
    let around = Corners { eye: Vec3::new(0.4, 0.9, 3.6), target: Vec3::ZERO, half_m: 0.6 };
    let stage = Stage::with_corners(uv_sphere(1.0, 32), &around.samples(4));
    let described = SetDescription { environment: Some(&on_device), ..stage.description() };
    let set = reconstructor().upload(&stage.images, &described, Turn::default()).expect("a sample set");
    let methods = [CARVE, SEARCH, ReconstructionMethod::Mesh, ReconstructionMethod::HybridMesh { merged: None }];
    for method in methods {
        let views = [around.view(), around.camera(-0.7, 0.6, VIEW_PX)];
        let found = reconstruct(&set, &views, method, ViewPlanes::ALL).expect("views");
        for (camera, view) in views.iter().zip(found) {
            let without = stage.view(camera, method);
            let pixels = (0..VIEW_PX.y).flat_map(|y| (0..VIEW_PX.x).map(move |x| Vec2::new(x as f32, y as f32) + 0.5));
            let codes = view.srgb8.as_chunks::<3>().0.iter().zip(without.srgb8.as_chunks::<3>().0);
            let mut open = 0;
            for ((pixel, depth), (found, plain)) in pixels.zip(depths(&view)).zip(codes) {
                if *depth > 0.0 {
                    assert_eq!(found, plain, "{method:?} at {pixel}: surfaces stay");
                    continue;
                }
                let radiance = map.radiance_linear(camera.ray(pixel).direction_in_world.normalize_or_zero());
                let wanted = radiance.to_array().map(srgb8_from_linear);
                let is_close = found.iter().zip(wanted).all(|(a, b)| a.abs_diff(b) <= 2);
                assert!(is_close, "{method:?} at {pixel}: {found:?}, not {wanted:?}");
                open += 1;
            }
            assert!(open >= count(&view, ProvenanceKind::Empty) && open > 300, "{method:?}: {open}");
        }
    }
}
