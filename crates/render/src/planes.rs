//! Finished planes: words that a batch wrote, plane by plane and camera by camera, to views and depth images.

use depth_image::{
    Camera, DepthImage, PinholeCamera, Provenance, ProvenanceKind, SpecularPlanes, SurfaceId, View, ViewPlanes,
};

/// The places of planes among those of a camera, after colour (0) and inverse depth (1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct PlaneLayout {
    pub normal: Option<usize>,
    /// Words of visibility follow.
    pub reflector: Option<usize>,
    pub visibility_words: usize,
    /// Instance and primitive.
    pub surface_id: Option<usize>,
    pub passed: Option<usize>,
    pub count: usize,
}

/// Each camera with its planes.
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

pub(crate) fn views(
    words: &[u32],
    layout: PlaneLayout,
    cameras: &[PinholeCamera],
    planes: ViewPlanes,
    views: &mut Vec<View>,
) {
    for (camera, own) in split(words, layout.count, cameras) {
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

pub(crate) fn depth_images(
    words: &[u32],
    layout: PlaneLayout,
    cameras: &[PinholeCamera],
    images: &mut Vec<DepthImage>,
) {
    for (camera, own) in split(words, layout.count, cameras) {
        let specular = |reflector: usize| SpecularPlanes {
            reflectance_srgb8_roughness8: own[reflector].to_vec(),
            visibility8: own[reflector + 1..][..layout.visibility_words].iter().map(|plane| plane.to_vec()).collect(),
        };
        let id = |(&instance, &primitive): (&u32, &u32)| SurfaceId { instance, primitive };
        images.push(DepthImage {
            camera: Camera::Pinhole(*camera),
            inverse_depth_per_m: bytemuck::cast_slice(own[1]).to_vec(),
            color_rgb9e5: own[0].to_vec(),
            normal_oct16: layout.normal.map(|normal| own[normal].to_vec()),
            surface_id: layout.surface_id.map(|ids| own[ids].iter().zip(own[ids + 1]).map(id).collect()),
            specular: layout.reflector.map(specular),
            passed: layout.passed.and_then(|passed| passed_plane(own[passed])),
            corner_inverse_depth_per_m: None,
        });
    }
}

/// `None` where no ray passed anything.
fn passed_plane(words: &[u32]) -> Option<Vec<bool>> {
    words.iter().any(|&word| word != 0).then(|| words.iter().map(|&word| word != 0).collect())
}
