//! Finished planes: those that are asked for, and the words that a batch wrote, plane by plane and camera by camera, as views
//! and depth images.

use depth_image::{
    Antialias, Camera, DepthImage, Highlight, LightPlanes, Provenance, ProvenanceKind, SpecularPlanes, SurfaceId, View,
    ViewPlanes,
};

use crate::{sums::SumPlanes, work::DrawWork};

/// What a batch writes of each pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub(crate) struct Output {
    pub sums: SumPlanes,
    /// Samples of depth images, or else colours of views.
    pub samples: bool,
    /// Positions within a pixel whose mean is a view's colour. Those of depth images lie around the centre, which counts, too.
    pub antialias: Antialias,
    /// Whether depth is wanted, which is the centre's.
    pub depth: bool,
    /// Highlights of a view, for its own eye.
    pub highlight: Option<Highlight>,
    /// Mirrors of a view show the scene.
    pub mirrors: bool,
    /// Rays of lobes bring what mirrors do not show.
    pub glossy: bool,
    /// Glass shows what is behind it.
    pub glass: bool,
    pub normal: bool,
    pub reflector: bool,
    pub surface_id: bool,
    /// Normals of triangles are found beside surfaces.
    pub triangle_normal: bool,
    /// Samples have light in place of colour.
    pub light: bool,
    /// Views say where the light of each pixel is from.
    pub provenance: bool,
    /// Whether pixels that other images cover are holes.
    pub covered: bool,
    /// Whether redundant surfaces lie before the sample.
    pub passed: bool,
    /// Which places of lamps pixels see is read in place of the planes.
    pub lamp_bits: bool,
}

/// The places of planes among those of a camera, after colour (0) and inverse depth (1).
pub(crate) struct PlaneLayout {
    pub normal: Option<usize>,
    /// Words of visibility follow.
    pub reflector: Option<usize>,
    /// Instance and primitive.
    pub surface_id: Option<usize>,
    pub passed: Option<usize>,
    /// Light of the environment, and shares, beside light of lamps in place of colour.
    pub light: Option<usize>,
    pub provenance: Option<usize>,
    pub count: usize,
}

impl Output {
    /// The planes that every picture of this work has; `reflects` where highlights need what rays met.
    pub fn of(work: DrawWork<'_>, reflects: bool) -> Self {
        let visibility = reflects && work.lighting.is_traced();
        Self { sums: SumPlanes { light_count: work.scene.light_count, visibility }, ..Self::default() }
    }

    /// Whether rays bring light to pixels from beyond their surfaces.
    pub fn follows_rays(&self) -> bool {
        self.mirrors || self.glass
    }

    /// Words of packed shares of light.
    pub fn share_words(&self) -> usize {
        if self.sums.visibility { LightPlanes::share_planes(self.sums.light_count) } else { 0 }
    }

    /// The places of planes among those of a camera.
    pub fn layout(&self) -> PlaneLayout {
        let mut count = 2;
        let mut place = |is: bool, planes: usize| {
            let first = is.then_some(count);
            count += if is { planes } else { 0 };
            first
        };
        let normal = place(self.normal, 1);
        let reflector = place(self.reflector, 1 + self.sums.visibility_words());
        let surface_id = place(self.surface_id, 2);
        let passed = place(self.passed, 1);
        let light = place(self.light, 2 + self.share_words());
        let provenance = place(self.provenance, 1);
        PlaneLayout { normal, reflector, surface_id, passed, light, provenance, count }
    }
}

/// The cameras, each with its planes.
fn split<'a>(
    mut words: &'a [u32],
    planes: usize,
    cameras: &'a [Camera],
) -> impl Iterator<Item = (&'a Camera, Vec<&'a [u32]>)> {
    cameras.iter().map(move |camera| {
        let (own, rest) = words.split_at(camera.pixel_count() * planes);
        words = rest;
        (camera, own.chunks_exact(camera.pixel_count()).collect())
    })
}

/// `lit` is the provenance of surfaces where no plane says it.
pub(crate) fn views(
    words: &[u32],
    output: Output,
    cameras: &[Camera],
    planes: ViewPlanes,
    lit: ProvenanceKind,
) -> Vec<View> {
    let layout = output.layout();
    let views = split(words, layout.count, cameras).map(|(camera, own)| {
        let inverse_depth: &[f32] = bytemuck::cast_slice(own[1]);
        View {
            size_px: camera.size_px(),
            srgb8: own[0].iter().flat_map(|word| word.to_le_bytes().into_iter().take(3)).collect(),
            inverse_depth_per_m: planes.inverse_depth.then(|| inverse_depth.to_vec()),
            provenance: planes.provenance.then(|| match layout.provenance {
                Some(plane) => own[plane].iter().map(|&word| Provenance(word)).collect(),
                None => inverse_depth
                    .iter()
                    .map(|&inverse| if inverse > 0.0 { Provenance::new(lit, 0) } else { Provenance::EMPTY })
                    .collect(),
            }),
        }
    });
    views.collect()
}

pub(crate) fn depth_images(words: &[u32], output: Output, cameras: &[Camera]) -> Vec<DepthImage> {
    let layout = output.layout();
    let images = split(words, layout.count, cameras).map(|(camera, own)| DepthImage {
        camera: *camera,
        inverse_depth_per_m: bytemuck::cast_slice(own[1]).to_vec(),
        color_rgb9e5: if output.light { Vec::new() } else { own[0].to_vec() },
        normal_oct16: layout.normal.map(|normal| own[normal].to_vec()),
        surface_id: layout.surface_id.map(|ids| {
            let ids = own[ids].iter().zip(own[ids + 1]);
            ids.map(|(&instance, &primitive)| SurfaceId { instance, primitive }).collect()
        }),
        specular: layout.reflector.map(|reflector| SpecularPlanes {
            reflectance_srgb8_roughness8: own[reflector].to_vec(),
            visibility8: to_vecs(&own[reflector + 1..][..output.sums.visibility_words()]),
        }),
        // None where no ray passed anything.
        passed: layout
            .passed
            .map(|passed| own[passed].iter().map(|&word| word != 0).collect::<Vec<bool>>())
            .filter(|passed| passed.contains(&true)),
        corner_inverse_depth_per_m: None,
        light: layout.light.map(|first| LightPlanes {
            triangle_normal_oct16: own[first].to_vec(),
            lamps_rgb9e5: own[0].to_vec(),
            environment_rgb9e5: own[first + 1].to_vec(),
            share8: to_vecs(&own[first + 2..][..output.share_words()]),
        }),
    });
    images.collect()
}

fn to_vecs(planes: &[&[u32]]) -> Vec<Vec<u32>> {
    planes.iter().map(|plane| plane.to_vec()).collect()
}
