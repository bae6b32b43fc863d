//! Rays into the lobes of the rough surfaces that a view shows: each surface is listed once, and sends one ray after another.

use bytemuck::{Pod, Zeroable};
use gpu::{Binding, ShaderVariant, shader_variant};
use minijinja::Value;
use wgpu::{Buffer, BufferUsages};

use crate::bounce::{Bounces, RayLists};
use crate::pixel_list::empty_lists;
use crate::reflectors::Reflection;
use crate::view_work::SetVariant;
use crate::{device::Device, error::ReconstructionError, recording::Recording};

/// `LobeRays` of `bounce/lobe_rays.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuLobeRays {
    pub count: u32,
    pub number: u32,
}

/// The rough surfaces of one position within the pixels.
pub(crate) struct GlossyList<'b> {
    surfaces: &'b Buffer,
    /// Of their pixels, from all of their rays.
    pub light: &'b Buffer,
    pub list: Buffer,
    /// Rays of each.
    pub rays: u32,
    count: Buffer,
}

impl<'b> GlossyList<'b> {
    /// None as yet. `None` where no rays are sent.
    pub fn of(recording: &Recording<'_>, bounces: &'b Bounces<'_>) -> Option<Self> {
        let [surfaces, light] = bounces.lobes.as_ref()?;
        // The positions within a pixel share its rays.
        let rays = bounces.glossy_rays.div_ceil(recording.batch.planes.antialias.samples());
        let list = empty_lists(&recording.device.gpu, "glossy surfaces", 1);
        Some(Self { surfaces, light, list, rays, count: uniform(recording.device, rays, 0) })
    }

    /// The resources of passes that list surfaces, and of those that send their rays.
    pub fn bindings(&self) -> [Binding<'_>; 5] {
        [
            Binding::buffer("lobe_rays", &self.count),
            Binding::buffer("glossy_surfaces", self.surfaces),
            Binding::buffer("glossy", self.surfaces),
            Binding::buffer("glossy_list", &self.list),
            Binding::buffer("lobe_light", self.light),
        ]
    }
}

fn uniform(device: &Device, count: u32, number: u32) -> Buffer {
    device.gpu.buffer_with("rays of lobes", &[GpuLobeRays { count, number }], BufferUsages::UNIFORM)
}

/// One ray of each listed surface.
#[derive(Debug)]
pub(crate) struct Lobe;

impl ShaderVariant for Lobe {
    const TEMPLATE: &'static str = "bounce/lobe.wgsl";

    fn context(&self) -> Value {
        Reflection { mirror_cells: Some(1), ..Reflection::default() }.context(SetVariant::CUBE)
    }

    fn all() -> Vec<Self> {
        vec![Self]
    }
}

/// Records the pass that sends one of the rays of all listed surfaces; gives their lists.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    bounces: &Bounces<'_>,
    glossy: &GlossyList<'_>,
    number: u32,
    illumination: &Buffer,
) -> Result<RayLists, ReconstructionError> {
    let lists = bounces.next(recording.device, None);
    let count = uniform(recording.device, glossy.rays, number);
    let own = [Binding::buffer("illumination", illumination), Binding::buffer("lobe_rays", &count)];
    let own = own.into_iter().chain(glossy.bindings()).chain(bounces.spawn_bindings(&lists));
    recording.dispatch_listed(&Lobe, own, &glossy.list, 0, ())?;
    Ok(lists)
}

// Adds the light of all rays to the pixels.
shader_variant!(LobeSum, "bounce/lobe_sum.wgsl", &[]);
