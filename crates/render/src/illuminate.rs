//! Light of lamps and the environment, summed over rays.

use std::sync::Arc;

use gpu::{Binding, DispatchSize, Frame, Gpu, PassCache, ResourceTraits, ShaderVariant, Templates, switches};
use minijinja::{Value, context, value::merge_maps};

use crate::{
    RenderError,
    pixel_camera::CAMERA_TRAITS,
    pixel_list::PixelList,
    rays::{Traced, Traversal},
    sums::SumPlanes,
    surfaces::Surfaces,
};

/// Pixels for which an adaptive rate traces rays in any case lie this far apart.
pub(crate) const GRID_PX: u32 = 4;

/// The rays to a lamp that a shader is written for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum ShadowRays {
    None,
    /// One, to the middle.
    One,
    /// As many as the uniform says, spread over the lamp.
    Many,
}

/// The pixels that a pass lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Domain {
    All,
    /// Each [`GRID_PX`]-th in both directions.
    Grid,
    /// The pixels of a [`PixelList`].
    List,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct IlluminateVariant {
    pub by_rays: bool,
    pub domain: Domain,
    pub shadow_rays: ShadowRays,
    /// Rays look for surfaces that occlude the environment.
    pub occluded: bool,
    /// Light is added to sums of earlier rays.
    pub continued: bool,
    pub sums: SumPlanes,
    /// Present where rays are traced.
    pub traversal: Option<Traversal>,
}

impl ShaderVariant for IlluminateVariant {
    const TEMPLATE: &'static str = "illuminate.wgsl";
    const TRAITS: ResourceTraits = CAMERA_TRAITS;

    fn context(&self) -> Value {
        context! {
            by_rays => self.by_rays,
            domain => match self.domain { Domain::All => "all", Domain::Grid => "grid", Domain::List => "list" },
            shadow_rays => match self.shadow_rays {
                ShadowRays::None => "none",
                ShadowRays::One => "one",
                ShadowRays::Many => "many",
            },
            occluded => self.occluded,
            continued => self.continued,
            traced => self.traversal.is_some(),
            primary => false,
            count_visits => false,
            ..merge_maps([self.sums.context(), self.traversal.map(Traversal::context).unwrap_or_default()])
        }
    }

    fn all() -> Vec<Self> {
        let mut variants = Vec::new();
        for [by_rays, occluded, continued] in switches() {
            for domain in [Domain::All, Domain::Grid, Domain::List] {
                for shadow_rays in [ShadowRays::None, ShadowRays::One, ShadowRays::Many] {
                    let is_traced = occluded || shadow_rays != ShadowRays::None;
                    let traversals = Traversal::ALL.map(|traversal| is_traced.then_some(traversal));
                    let each = |sums| {
                        traversals.map(|traversal| Self {
                            by_rays,
                            domain,
                            shadow_rays,
                            occluded,
                            continued,
                            sums,
                            traversal,
                        })
                    };
                    variants.extend(SumPlanes::all().flat_map(each));
                }
            }
        }
        variants
    }
}

/// The surfaces' light to be summed.
#[derive(Clone, Copy)]
pub(crate) struct IlluminateWork<'a> {
    /// The domain and `continued` are set for each pass.
    pub variant: IlluminateVariant,
    /// Present where rays are traced.
    pub traced: Option<&'a Traced>,
    pub illumination: &'a wgpu::Buffer,
    /// One uniform of all cameras for each part of the rays.
    pub cameras: &'a [wgpu::Buffer],
    pub sums: &'a wgpu::Buffer,
}

/// The pixels to be lit.
#[derive(Clone, Copy)]
pub(crate) enum Pixels<'a> {
    All,
    Grid,
    /// The pixels of one camera.
    List(&'a PixelList),
}

impl<'a> Pixels<'a> {
    fn domain(self) -> Domain {
        match self {
            Self::All => Domain::All,
            Self::Grid => Domain::Grid,
            Self::List(_) => Domain::List,
        }
    }

    fn size(self, target: &Surfaces) -> DispatchSize<'a> {
        match self {
            Self::All => target.invocations(1),
            Self::Grid => target.invocations(GRID_PX),
            Self::List(list) => list.size(),
        }
    }
}

pub(crate) struct Illuminate(PassCache);

impl Illuminate {
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self(PassCache::new(gpu, templates))
    }

    /// Records one dispatch for each part of the rays and camera, from the `first`-th on.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        work: IlluminateWork<'_>,
        pixels: Pixels<'_>,
        (first, surfaces): (u32, &[Surfaces]),
    ) -> Result<(), RenderError> {
        for (part, cameras) in work.cameras.iter().enumerate() {
            let continued = work.variant.continued || part > 0;
            let variant = IlluminateVariant { domain: pixels.domain(), continued, ..work.variant };
            let pass = self.0.get(&variant)?;
            let rays = work.traced.map(|traced| pass.bind(1, traced.bindings())).transpose()?;
            for (element, target) in (first..).zip(surfaces) {
                let own = pass.bind(0, bindings(&work, cameras, pixels, target))?;
                let groups: Vec<_> = std::iter::once(&own).chain(&rays).collect();
                pass.dispatch_each(frame, &groups, element..element + 1, pixels.size(target));
            }
        }
        Ok(())
    }
}

fn bindings<'r>(
    work: &IlluminateWork<'r>,
    cameras: &'r wgpu::Buffer,
    pixels: Pixels<'r>,
    target: &'r Surfaces,
) -> Vec<Binding<'r>> {
    let mut bindings = vec![
        Binding::buffer("camera", cameras),
        Binding::buffer("illumination", work.illumination),
        Binding::buffer("sums", work.sums),
    ];
    bindings.extend(target.bindings());
    if let Pixels::List(list) = pixels {
        bindings.extend(list.bindings());
    }
    bindings
}

#[cfg(test)]
mod tests {
    use gpu::BufferPool;

    use super::*;
    use crate::test_support::TestStage;

    #[test]
    fn every_variant_is_bound_by_its_names() {
        let stage = TestStage::new();
        let (traced, buffer) = (stage.scene.rays.at(0.0).expect("a tree"), &stage.buffer);
        let list = PixelList::new(&stage.gpu, &BufferPool::new(&stage.gpu), &stage.surfaces(false, false));
        for variant in IlluminateVariant::all() {
            let target = stage.surfaces(variant.by_rays, false);
            let pixels = match variant.domain {
                Domain::All => Pixels::All,
                Domain::Grid => Pixels::Grid,
                Domain::List => Pixels::List(&list),
            };
            let work = IlluminateWork { variant, traced: None, illumination: buffer, cameras: &[], sums: buffer };
            stage.check(&variant, 0, &bindings(&work, buffer, pixels, &target));
            if variant.traversal.is_some() {
                stage.check(&variant, 1, &traced.bindings());
            }
        }
    }
}
