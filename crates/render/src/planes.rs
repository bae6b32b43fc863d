//! Words that a batch wrote, plane by plane and camera by camera, to views and depth images.

use depth_image::{
    Camera, DepthImage, PinholeCamera, Provenance, ProvenanceKind, SpecularPlanes, SurfaceId, View, ViewPlanes,
};

use crate::form::Form;

/// Each camera with its words.
fn split<'a>(
    mut words: &'a [u32],
    planes: usize,
    cameras: &'a [PinholeCamera],
) -> impl Iterator<Item = (&'a PinholeCamera, Vec<&'a [u32]>)> {
    cameras.iter().map(move |camera| {
        let (own, rest) = words.split_at(camera.pixel_count() * planes);
        words = rest;
        (camera, own.chunks_exact(camera.pixel_count()).collect())
    })
}

pub(crate) fn views(words: &[u32], form: Form, cameras: &[PinholeCamera], planes: ViewPlanes, views: &mut Vec<View>) {
    let [.., count] = form.planes();
    for (camera, own) in split(words, count, cameras) {
        let inverse_depth: &[f32] = bytemuck::cast_slice(own[1]);
        let hit =
            |&inverse: &f32| if inverse > 0.0 { Provenance::new(ProvenanceKind::Hit, 0) } else { Provenance::EMPTY };
        let rgb = |word: &u32| word.to_le_bytes().into_iter().take(3);
        views.push(View {
            size_px: camera.size_px,
            srgb8: own[0].iter().flat_map(rgb).collect(),
            inverse_depth_per_m: planes.inverse_depth.then(|| inverse_depth.to_vec()),
            provenance: planes.provenance.then(|| inverse_depth.iter().map(hit).collect()),
        });
    }
}

pub(crate) fn depth_images(words: &[u32], form: Form, cameras: &[PinholeCamera], images: &mut Vec<DepthImage>) {
    let [normal, reflector, ids, passed, count] = form.planes();
    for (camera, own) in split(words, count, cameras) {
        let visibility = reflector + 1..reflector + 1 + form.visibility_words();
        let specular = form.reflector.then(|| SpecularPlanes {
            reflectance_srgb8_roughness8: own[reflector].to_vec(),
            visibility8: own[visibility].iter().map(|plane| plane.to_vec()).collect(),
        });
        let id = |(&instance, &primitive): (&u32, &u32)| SurfaceId { instance, primitive };
        images.push(DepthImage {
            camera: Camera::Pinhole(*camera),
            inverse_depth_per_m: bytemuck::cast_slice(own[1]).to_vec(),
            color_rgb9e5: own[0].to_vec(),
            normal_oct16: form.normal.then(|| own[normal].to_vec()),
            surface_id: form.surface_id.then(|| own[ids].iter().zip(own[ids + 1]).map(id).collect()),
            specular,
            passed: form.leave_out.and_then(|_| passed_plane(own[passed])),
            corner_inverse_depth_per_m: None,
        });
    }
}

/// `None` where no ray passed anything.
fn passed_plane(words: &[u32]) -> Option<Vec<bool>> {
    words.iter().any(|&word| word != 0).then(|| words.iter().map(|&word| word != 0).collect())
}
