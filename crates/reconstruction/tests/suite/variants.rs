//! Every pass is built and bound to its resources in every variant that changes what it binds.

use depth_image::{HOLE_INVERSE_DEPTH, ProvenanceKind, ViewPlanes};
use fixtures::uv_sphere;
use glam::{UVec2, Vec3};
use reconstruction::METHODS;

use crate::stage::{Corners, Stage, count, reconstruct};

#[test]
fn every_method_binds_all_names_of_its_shaders() {
    let corners = Corners { eye: Vec3::new(0.4, 0.9, 3.6), target: Vec3::ZERO, half_m: 0.6 };
    let camera = corners.camera(0.2, 0.1, UVec2::new(16, 12));
    for (cameras, holes) in [(1, false), (1, true), (3, false), (3, true)] {
        let mut stage = Stage::with_corners(uv_sphere(1.0, 12), &corners.samples(cameras));
        if holes {
            stage.images[0].inverse_depth_per_m[0] = HOLE_INVERSE_DEPTH;
        }
        let set = stage.upload();
        let of_images = METHODS.map(|row| row.method).into_iter().filter(|method| !method.walks_cube());
        let of_images = of_images.filter(|method| method.light_cache_quality().is_none());
        for method in of_images.flat_map(|method| [Some(method), method.coarser()]) {
            let Some(method) = method else { continue };
            let views = reconstruct(&set, &[camera], method, ViewPlanes::ALL)
                .unwrap_or_else(|error| panic!("{method}, {cameras} cameras, holes {holes}: {error}"));
            assert!(count(&views[0], ProvenanceKind::Hit) > 10, "{method}, {cameras} cameras, holes {holes}");
        }
    }
}
