//! Light of lamps and the environment, summed over rays.

use depth_image::Highlight;
use gpu::{
    Binding, BoundGroup, DispatchSize, GpuEnvironment, ResourceTraits, ShaderVariant, WorkKind, highlight_name,
    switches,
};
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum ShadowRays {
    None,
    /// One, to the middle.
    One,
    /// As many as the uniform says, spread over the lamp.
    Many,
}

/// The rays of ambient light that a shader is written for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum AmbientRays {
    None,
    /// They look for surfaces that occlude the environment.
    Occlusion,
    /// They bring what surfaces send back.
    Indirect,
}

#[derive(Debug)]
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

impl Illuminate {
    /// The variant without any of the switches.
    const UNLIT: Self = Self {
        by_rays: false,
        single_pole: false,
        listed: false,
        knows_ambient: false,
        bounces: false,
        shadow_rays: ShadowRays::None,
        ambient: AmbientRays::None,
        continued: false,
        sums: SumPlanes { light_count: 0, visibility: false },
        environment_map: false,
        traversal: None,
    };
}

impl ShaderVariant for Illuminate {
    const TEMPLATE: &'static str = "illuminate.wgsl";
    const TRAITS: ResourceTraits = CAMERA_TRAITS;

    fn context(&self) -> Value {
        context! {
            by_rays => self.by_rays,
            single_pole => self.single_pole,
            listed => self.listed,
            knows_ambient => self.knows_ambient,
            bounces => self.bounces,
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
            continued => self.continued,
            environment_map => self.environment_map,
            traced => self.traversal.is_some(),
            primary => self.ambient == AmbientRays::Indirect,
            from_eye => false,
            shading => highlight_name(Highlight::Ggx),
            ..merge_maps([self.sums.context(), self.traversal.map(Traversal::context).unwrap_or_default()])
        }
    }

    fn all() -> Vec<Self> {
        let mut variants = Vec::new();
        for [by_rays, continued, environment_map] in switches() {
            for listed in [false, true] {
                for (shadow_rays, ambient) in Self::RAYS {
                    let lit = Self { by_rays, listed, shadow_rays, ambient, continued, ..Self::UNLIT };
                    variants.extend(Self { environment_map, ..lit }.with_all_sums());
                }
            }
        }
        for listed in [false, true] {
            let bent = Self { by_rays: true, single_pole: true, listed, ..Self::UNLIT };
            let lit = Self { shadow_rays: ShadowRays::Many, ambient: AmbientRays::Occlusion, ..bent };
            variants.extend([bent, lit].iter().flat_map(Self::with_all_sums));
        }
        for [by_rays, continued, environment_map] in switches() {
            let shadow_rays = ShadowRays::Many;
            let ambient = AmbientRays::Indirect;
            let lit =
                Self { by_rays, listed: true, knows_ambient: true, shadow_rays, ambient, continued, ..Self::UNLIT };
            variants.extend(Self { environment_map, ..lit }.with_all_sums());
        }
        for [continued, environment_map] in switches() {
            for (shadow_rays, ambient) in Self::RAYS {
                let lit = Self { bounces: true, shadow_rays, ambient, continued, ..Self::UNLIT };
                variants.extend(Self { environment_map, ..lit }.with_all_sums());
            }
        }
        variants
    }
}

impl Illuminate {
    /// The kinds of rays that go together.
    const RAYS: [(ShadowRays, AmbientRays); 8] = [
        (ShadowRays::None, AmbientRays::None),
        (ShadowRays::None, AmbientRays::Occlusion),
        (ShadowRays::One, AmbientRays::None),
        (ShadowRays::One, AmbientRays::Occlusion),
        (ShadowRays::One, AmbientRays::Indirect),
        (ShadowRays::Many, AmbientRays::None),
        (ShadowRays::Many, AmbientRays::Occlusion),
        (ShadowRays::Many, AmbientRays::Indirect),
    ];

    /// With each kind of sums, and with each traversal where rays are traced.
    fn with_all_sums(&self) -> Vec<Self> {
        let is_traced = self.ambient != AmbientRays::None || self.shadow_rays != ShadowRays::None;
        let each =
            |sums| Traversal::ALL.map(|traversal| Self { sums, traversal: is_traced.then_some(traversal), ..*self });
        SumPlanes::all().flat_map(each).collect()
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
            ..Self::UNLIT
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
        for (camera, target) in (first..).zip(surfaces) {
            let buffers = [&part.cameras, &batch.work.scene.illumination, &recording.sums.buffer];
            let map = batch.work.scene.environment.as_deref();
            let bind = |list: Option<&PixelList>| {
                let listed = list.into_iter().flat_map(PixelList::bindings);
                pass.bind(0, bindings(buffers, map).chain(target.bindings()).chain(listed))
            };
            let own = match lists {
                Some(lists) => lists.iter().map(|list| bind(Some(list))).collect::<Result<Vec<_>, _>>()?,
                None => vec![bind(None)?],
            };
            recording.dispatch_pieces(kind, &pass, camera, |place, piece, width_px| {
                let all = DispatchSize::Invocations([width_px, piece.end_row - piece.first_row, 1]);
                let (own, size) = lists.map_or((&own[0], all), |lists| (&own[place], lists[place].size()));
                (std::iter::once(own).chain(&rays).collect(), size)
            });
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
        let bounces = BounceList::new(&stage.gpu);
        let points = Rays { bounces: buffer, list: &bounces, units: 1, generation: 1 };
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
