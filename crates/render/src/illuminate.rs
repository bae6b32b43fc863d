//! Light of lamps and the environment, summed over rays.

use depth_image::Highlight;
use gpu::{Binding, ResourceTraits, ShaderVariant, highlight_name, switches};
use minijinja::{Value, context, value::merge_maps};
use wgpu::Buffer;

use crate::rays::Traversal;
use crate::{
    Ambient, Direct, RenderError,
    batch::{Batch, Part, Recording},
    pixel_camera::CAMERA_TRAITS,
    pixel_list::PixelList,
    reflections::bounces::Rays,
    sums::SumPlanes,
    surfaces::Surfaces,
};

/// The rays to a lamp that a shader is written for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
enum ShadowRays {
    #[default]
    None,
    /// One, to the middle.
    One,
    /// As many as the uniform says, spread over the lamp.
    Many,
}

/// The rays of ambient light that a shader is written for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
enum AmbientRays {
    #[default]
    None,
    /// They look for surfaces that occlude the environment.
    Occlusion,
    /// They bring what surfaces send back.
    Indirect,
}

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Illuminate {
    by_rays: bool,
    /// The pixels' own rays lie around a pole.
    single_pole: bool,
    listed: bool,
    /// Ambient light of the pixels at the list's end is in the sums already.
    knows_ambient: bool,
    /// Lit are listed points, such as those where mirrored rays end, not pixels.
    bounces: bool,
    shadow_rays: ShadowRays,
    ambient: AmbientRays,
    /// Light is added to sums of earlier rays.
    continued: bool,
    sums: SumPlanes,
    /// The environment is a map.
    environment_map: bool,
    /// Present where rays are traced.
    traversal: Option<Traversal>,
}

impl ShaderVariant for Illuminate {
    const TEMPLATE: &'static str = "illuminate.wgsl";
    const TRAITS: ResourceTraits = CAMERA_TRAITS;

    fn context(&self) -> Value {
        let Self { by_rays, single_pole, listed, knows_ambient, bounces, continued, environment_map, .. } = *self;
        context! {
            by_rays, single_pole, listed, knows_ambient, bounces, continued, environment_map,
            shadow_rays => match self.shadow_rays {
                ShadowRays::None => "none",
                ShadowRays::One => "one",
                ShadowRays::Many => "many",
            },
            ambient => match self.ambient {
                AmbientRays::None => "none",
                AmbientRays::Occlusion => "occlusion",
                AmbientRays::Indirect => "indirect",
            },
            traced => self.traversal.is_some(),
            primary => self.ambient == AmbientRays::Indirect,
            from_eye => false,
            shading => highlight_name(Highlight::Ggx),
            ..merge_maps([self.sums.context(), self.traversal.map(Traversal::context).unwrap_or_default()])
        }
    }

    fn all() -> Vec<Self> {
        let mut lit = Vec::new();
        for [by_rays, listed, bounces, continued, environment_map] in switches() {
            for shadow_rays in [ShadowRays::None, ShadowRays::One, ShadowRays::Many] {
                for ambient in [AmbientRays::None, AmbientRays::Occlusion, AmbientRays::Indirect] {
                    let plain = Self { by_rays, listed, bounces, continued, environment_map, ..Self::default() };
                    lit.push(Self { shadow_rays, ambient, ..plain });
                }
            }
        }
        // Points have a list of their own, and indirect light is that of lamps with rays.
        lit.retain(|variant| !(variant.bounces && (variant.by_rays || variant.listed)));
        lit.retain(|variant| variant.rays() != (ShadowRays::None, AmbientRays::Indirect));
        let many_indirect = (ShadowRays::Many, AmbientRays::Indirect);
        let indirect = lit.iter().filter(|variant| variant.listed && variant.rays() == many_indirect);
        let indirect = indirect.map(|variant| Self { knows_ambient: true, ..*variant });
        let kinds = [(ShadowRays::None, AmbientRays::None), (ShadowRays::Many, AmbientRays::Occlusion)];
        let bent = lit.iter().filter(|variant| variant.by_rays && !variant.continued && !variant.environment_map);
        let bent = bent.filter(|variant| kinds.contains(&variant.rays()));
        let bent = bent.map(|variant| Self { single_pole: true, ..*variant });
        lit.iter().copied().chain(indirect).chain(bent).flat_map(Self::with_all_sums).collect()
    }
}

impl Illuminate {
    fn rays(&self) -> (ShadowRays, AmbientRays) {
        (self.shadow_rays, self.ambient)
    }

    /// With each kind of sums, and with each traversal where rays are traced.
    fn with_all_sums(self) -> impl Iterator<Item = Self> {
        let is_traced = self.rays() != (ShadowRays::None, AmbientRays::None);
        SumPlanes::all().flat_map(move |sums| {
            Traversal::ALL.map(|traversal| Self { sums, traversal: is_traced.then_some(traversal), ..self })
        })
    }

    /// The variant for all pixels of a batch.
    fn of(batch: &Batch<'_>) -> Self {
        let lighting = batch.work.lighting;
        let traced = batch.traced.as_deref().filter(|_| lighting.is_traced());
        Self {
            by_rays: batch.by_rays,
            single_pole: batch.is_single_pole(),
            shadow_rays: match lighting.direct {
                Direct::Unlit | Direct::Phong => ShadowRays::None,
                Direct::Shadows => ShadowRays::One,
                Direct::Soft(_) => ShadowRays::Many,
            },
            ambient: match lighting.ambient {
                None => AmbientRays::None,
                Some(Ambient::Occlusion(..)) => AmbientRays::Occlusion,
                Some(Ambient::Indirect(_)) => AmbientRays::Indirect,
            },
            sums: batch.output.sums,
            environment_map: batch.work.scene.environment.is_some(),
            traversal: traced.map(Traversal::of),
            ..Self::default()
        }
    }
}

/// Records one dispatch for each piece of these cameras and part of the rays. Lit are the pixels of a list for each piece of
/// the one camera, or else all.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    parts: &[Part],
    first: usize,
    surfaces: &[Surfaces],
    lists: Option<&[PixelList]>,
) -> Result<(), RenderError> {
    let batch = recording.batch;
    for (number, part) in parts.iter().enumerate() {
        let continued = number > 0 || recording.sums.rays.iter().any(|rays| rays.start > 0);
        let of_batch = Illuminate::of(batch);
        let knows_ambient = batch.cached.is_some() && of_batch.ambient == AmbientRays::Indirect;
        let variant = Illuminate { listed: lists.is_some(), knows_ambient, continued, ..of_batch };
        for (camera, target) in (first..).zip(surfaces) {
            let Some(lists) = lists else {
                let own = [Binding::buffer("camera", &part.cameras)].into_iter().chain(target.bindings());
                let bound = recording.bind(&variant, part.counts, own)?;
                recording.dispatch(&bound, camera);
                continue;
            };
            for (piece, list) in recording.pieces_of(camera).into_iter().zip(lists) {
                let own = [Binding::buffer("camera", &part.cameras)].into_iter().chain(target.bindings());
                let bound = recording.bind(&variant, part.counts, own.chain(list.bindings()))?;
                recording.dispatch_piece(&bound, piece, list.size());
            }
        }
    }
    Ok(())
}

/// Records the light that arrives at the ends of mirrored rays, in parts of the rays of light.
pub(crate) fn record_points(
    recording: &mut Recording<'_>,
    parts: &[Part],
    points: &Rays,
    sums: &Buffer,
) -> Result<(), RenderError> {
    for (number, part) in parts.iter().enumerate() {
        let of_batch = Illuminate::of(recording.batch);
        let variant = Illuminate { by_rays: false, bounces: true, continued: number > 0, ..of_batch };
        let own = [Binding::buffer("camera", &part.cameras), Binding::buffer("sums", sums)];
        let own = own.into_iter().chain(points.bindings());
        let bound = recording.bind(&variant, (part.counts, points.generation), own)?;
        points.dispatch(recording, &bound);
    }
    Ok(())
}
