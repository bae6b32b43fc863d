//! Light of lamps and the environment, summed over rays.

use depth_image::Highlight;
use gpu::{Binding, BoundGroup, GpuEnvironment, ResourceTraits, ShaderVariant, WorkKind, highlight_name, switches};
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
    let lighting = batch.work.lighting;
    let traced = batch.traced.as_deref().filter(|_| lighting.is_traced());
    for (number, part) in parts.iter().enumerate() {
        let continued = number > 0 || recording.sums.rays.iter().any(|rays| rays.start > 0);
        let of_batch = Illuminate::of(batch);
        let knows_ambient = batch.cached.is_some() && of_batch.ambient == AmbientRays::Indirect;
        let variant = Illuminate { listed: lists.is_some(), knows_ambient, continued, ..of_batch };
        let pass = recording.passes.get(&variant)?;
        let rays = traced.map(|traced| pass.bind(1, traced.bindings())).transpose()?;
        let kind = WorkKind::new(batch.family(), &(variant.name(), part.counts));
        let map = batch.work.scene.environment.as_deref();
        for (camera, target) in (first..).zip(surfaces) {
            let buffers = [&part.cameras, &batch.work.scene.illumination, &recording.sums.buffer];
            let lists_of_pieces = lists.map_or(vec![None], |lists| lists.iter().map(Some).collect());
            let own = lists_of_pieces.iter().map(|list| {
                let listed = list.iter().flat_map(|list| list.bindings());
                pass.bind(0, bindings(buffers, map).chain(target.bindings()).chain(listed))
            });
            let own = own.collect::<Result<Vec<_>, _>>()?;
            for (place, piece) in recording.pieces_of(camera).into_iter().enumerate() {
                let (own, size) = lists.map_or((&own[0], piece.size()), |lists| (&own[place], lists[place].size()));
                let groups: Vec<&BoundGroup> = std::iter::once(own).chain(&rays).collect();
                recording.dispatch_piece(kind, &pass, &groups, piece, size);
            }
        }
    }
    Ok(())
}

/// Records the light that arrives at the ends of mirrored rays, in parts of the rays of light.
pub(crate) fn record_points(
    recording: &mut Recording<'_>,
    parts: &[Part],
    points: Rays<'_>,
    sums: &Buffer,
) -> Result<(), RenderError> {
    let batch = recording.batch;
    let tree = batch.traced.as_deref();
    for (number, part) in parts.iter().enumerate() {
        let variant = Illuminate { by_rays: false, bounces: true, continued: number > 0, ..Illuminate::of(batch) };
        let pass = recording.passes.get(&variant)?;
        let buffers = [&part.cameras, &batch.work.scene.illumination, sums];
        let own = bindings(buffers, batch.work.scene.environment.as_deref()).chain(points.bindings());
        let own = pass.bind(0, own)?;
        let tree = tree.map(|tree| pass.bind(1, tree.bindings())).transpose()?;
        let groups: Vec<&BoundGroup> = std::iter::once(&own).chain(&tree).collect();
        points.dispatch(recording, &variant, part.counts, &pass, &groups);
    }
    Ok(())
}

/// Those of all variants.
fn bindings<'r>(
    [camera, illumination, sums]: [&'r Buffer; 3],
    map: Option<&'r GpuEnvironment>,
) -> impl Iterator<Item = Binding<'r>> {
    let buffers = [("camera", camera), ("illumination", illumination), ("sums", sums)];
    let buffers = buffers.into_iter().map(|(name, buffer)| Binding::buffer(name, buffer));
    buffers.chain(map.into_iter().flat_map(GpuEnvironment::bindings))
}

#[cfg(test)]
mod tests {
    use gpu::BufferPool;

    use super::*;
    use crate::{reflections::bounces::BounceList, test_support::TestStage};

    #[test]
    fn every_variant_is_bound_by_its_names() {
        let stage = TestStage::new();
        let traced = stage.scene.rays.at(0.0).expect("a tree");
        let buffer = &stage.buffer;
        let list = PixelList::new(&stage.gpu, &BufferPool::new(&stage.gpu), 1);
        let bounces = BounceList::new(&stage.gpu, 1);
        let points = Rays { bounces: buffer, list: &bounces, generation: 1 };
        for variant in Illuminate::all() {
            let target = stage.surfaces(variant.by_rays, false);
            let map = variant.environment_map.then_some(&stage.environment);
            let mut own: Vec<Binding<'_>> = bindings([buffer; 3], map).collect();
            if variant.bounces {
                own.extend(points.bindings());
            } else {
                own.extend(target.bindings());
                own.extend(variant.listed.then(|| list.bindings()).into_iter().flatten());
            }
            stage.check(&variant, 0, &own);
            if variant.traversal.is_some() {
                stage.check(&variant, 1, &traced.bindings());
            }
        }
    }
}
