//! Sampling on the software device: the planes that were asked for, and batches.

use std::sync::OnceLock;

use depth_image::{Camera, CameraError, DepthImage, PinholeCamera, ViewCell};
use glam::{UVec2, Vec3};
use render::{DrawWork, GpuScene, Lighting, RenderError, SamplePlanes, Visibility};
use sampling::{Rig, SampleWork, SamplingError, SamplingMethod};
use scene::procedural::courtyard;

use crate::stage::{device, pinholes, unlit, upload};

struct Yard {
    on_device: GpuScene,
    rig: Rig,
}

/// The courtyard, uploaded once for all tests of this file.
fn yard() -> &'static Yard {
    static YARD: OnceLock<Yard> = OnceLock::new();
    YARD.get_or_init(|| {
        let scene = courtyard();
        let rig = Rig::two_plane(&scene.bounds(), 2.5).expect("a rig");
        Yard { on_device: upload(&scene), rig }
    })
}

fn sample(cameras: &[Camera], planes: SamplePlanes) -> Result<Vec<DepthImage>, SamplingError> {
    let lighting = Lighting::default();
    let draw = DrawWork { lighting, visibility: Visibility::Triangles, ..unlit(&yard().on_device) };
    let wanted: Vec<u32> = (0..cameras.len() as u32).collect();
    let method = SamplingMethod::CONVENTIONAL;
    device().sampler.sample(&SampleWork { draw, cameras, tile_count: 1, wanted: &wanted, method, planes })
}

/// More than one submission holds, of two sizes.
fn cameras() -> Vec<Camera> {
    let sizes = [UVec2::new(40, 30), UVec2::new(33, 17)];
    let cell = ViewCell::between(&yard().rig.samples(sizes[0])).expect("four cameras");
    sizes.into_iter().flat_map(|size_px| cell.spread(20, size_px)).map(Camera::Pinhole).collect()
}

#[test]
fn requested_planes_are_present() {
    let cameras = pinholes(&yard().rig.samples(UVec2::new(40, 30)));
    let mut depth = None;
    for (normal, surface_id) in [(false, false), (true, false), (false, true), (true, true)] {
        let images = sample(&cameras, SamplePlanes { normal, surface_id, ..SamplePlanes::default() }).expect("images");
        assert_eq!(images.len(), 4);
        for image in &images {
            image.validate().expect("planes of one size");
            assert_eq!((image.normal_oct16.is_some(), image.surface_id.is_some()), (normal, surface_id));
            assert!(image.inverse_depth_per_m.iter().filter(|&&d| d > 0.0).count() > 100);
        }
        // Depth and colour do not depend on what else is asked for.
        let base: Vec<_> = images.into_iter().map(|i| (i.inverse_depth_per_m, i.color_rgb9e5)).collect();
        assert!(*depth.get_or_insert_with(|| base.clone()) == base, "{normal} {surface_id}");
    }
}

#[test]
fn a_batch_equals_its_single_images() {
    let planes = SamplePlanes { normal: true, surface_id: true, ..SamplePlanes::default() };
    let all = sample(&cameras(), planes).expect("images");
    assert_eq!(all.len(), 40);
    for (index, (camera, image)) in cameras().into_iter().zip(&all).enumerate() {
        assert_eq!(image.camera, camera);
        assert!(sample(&[camera], planes).expect("an image")[0] == *image, "image {index} differs");
    }
    assert!(sample(&[], planes).expect("nothing").is_empty());
}

#[test]
fn an_invalid_camera_is_named_in_the_error() {
    let mut cameras = cameras();
    cameras[3] = PinholeCamera { eye_in_world: Vec3::NAN, ..*cameras[3].reference() }.into();
    let error = sample(&cameras, SamplePlanes::default()).expect_err("NaN");
    let SamplingError::Render(RenderError::Camera { index: 3, source: CameraError::NotFinite { .. } }) = error else {
        panic!("{error}");
    };
}
