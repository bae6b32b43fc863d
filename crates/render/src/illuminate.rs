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

/// How many rays to a lamp a shader is written for.
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
    /// Those that [`PixelList`] lists.
    List,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct IlluminateVariant {
    pub by_rays: bool,
    pub domain: Domain,
    pub shadow_rays: ShadowRays,
    /// Whether rays look for what occludes the environment.
    pub occluded: bool,
    /// Whether sums are added to.
    pub continued: bool,
    pub sums: SumPlanes,
    /// Of variants that trace rays.
    pub traversal: Option<Traversal>,
}

impl ShaderVariant for IlluminateVariant {
    fn template(&self) -> &'static str {
        "illuminate.wgsl"
    }

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

    fn traits(&self) -> ResourceTraits {
        CAMERA_TRAITS
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
    /// The domain, and whether sums are added to, are set for each pass.
    pub variant: IlluminateVariant,
    /// Of variants that trace rays.
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
    /// Of one camera.
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

pub(crate) struct Illuminate(PassCache<IlluminateVariant>);

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
