//! Surface and light to finished planes: a view's colour and depth, or those of a depth image.

use bytemuck::{Pod, Zeroable};
use depth_image::{Antialias, Highlight};
use gpu::{Binding, BufferPool, Gpu, GpuTone, PooledBuffer, ShaderVariant, highlight_name, switches};
use minijinja::{Value, context};
use wgpu::{Buffer, BufferUsages};

use crate::batch::{Batch, Recording};
use crate::planes::{Output, PlaneLayout};
use crate::{RenderError, lamp_shares::GpuLampShares, sums::SumPlanes, surfaces::Surfaces};

/// Inverse depths within a texel differ by this share at most where they are of one surface.
pub const SAME_SURFACE: f32 = 0.005;

/// `Finish` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuFinish {
    pub tone: GpuTone,
    pub position: u32,
    pub position_count: u32,
    pub padding: [u32; 2],
    pub shares: GpuLampShares,
}

#[derive(Debug)]
pub(crate) struct Finish {
    by_rays: bool,
    /// Rays around a pole.
    single_pole: bool,
    lit: bool,
    /// The environment is a map, which is the background, too.
    environment_map: bool,
    output: Output,
}

impl Finish {
    fn of(batch: &Batch<'_>) -> Self {
        // One shader, whether depth is wanted or not, and for any number of positions.
        let is_averaged = batch.output.antialias > Antialias::NONE;
        let antialias = if is_averaged { Antialias::MOST } else { Antialias::NONE };
        let output = Output { depth: false, antialias, ..batch.output };
        let lit = batch.work.lighting.is_lit();
        let environment_map = batch.work.scene.environment.is_some();
        Self { by_rays: batch.by_rays, single_pole: batch.is_single_pole(), lit, environment_map, output }
    }

    fn of_images(output: Output) -> impl Iterator<Item = Self> {
        // Samples of light have no highlights.
        let all = switches().filter(move |[_, reflector, _]| !(output.light && *reflector));
        all.flat_map(move |[normal, reflector, surface_id]| {
            Self::of_output(Output { samples: true, normal, reflector, surface_id, ..output })
        })
    }

    fn of_output(output: Output) -> impl Iterator<Item = Self> {
        SumPlanes::all().flat_map(move |sums| {
            let output = Output { sums, ..output };
            switches().map(move |[by_rays, lit, environment_map]| Self {
                by_rays,
                single_pole: false,
                lit,
                environment_map,
                output,
            })
        })
    }
}

impl ShaderVariant for Finish {
    const TEMPLATE: &'static str = "finish.wgsl";

    fn context(&self) -> Value {
        let Self { by_rays, single_pole, lit, environment_map, output } = *self;
        let Output { sums, samples, mirrors, glossy, passed: redundancy, .. } = output;
        let reflected = output.follows_rays();
        let PlaneLayout { normal, reflector, surface_id, passed, light, count, .. } = output.layout();
        context! {
            by_rays, single_pole, lit, environment_map, samples, mirrors, reflected, glossy, redundancy,
            highlight => output.highlight.map(highlight_name),
            surface_id => surface_id.is_some(),
            normal_plane => normal, reflector_plane => reflector, id_plane => surface_id, passed_plane => passed,
            averaged => output.antialias > Antialias::NONE, plane_count => count,
            covered => output.covered,
            light => light.is_some(), light_plane => light, share_words => output.share_words(),
            ..sums.context()
        }
    }

    fn all() -> Vec<Self> {
        let plain = Output::default();
        let mut views = Vec::new();
        for highlight in [None, Some(Highlight::BlinnPhong), Some(Highlight::Ggx)] {
            for antialias in [Antialias::NONE, Antialias::MOST] {
                let output = Output { highlight, antialias, ..plain };
                views.push(output);
                if highlight == Some(Highlight::Ggx) {
                    views.extend([false, true].map(|glossy| Output { mirrors: true, glossy, ..output }));
                    views.push(Output { glass: true, ..output });
                }
            }
        }
        let light = Output { light: true, ..plain };
        let passed = [Output { passed: true, ..plain }, Output { passed: true, ..light }];
        let covered = [plain, light].map(|output| Output { covered: true, ..output });
        let averaged = Output { antialias: Antialias::MOST, ..plain };
        let images = [plain, averaged, light].into_iter().chain(covered).chain(passed);
        // Rays mark the pixels that show glass.
        let through = [plain, averaged, covered[0], passed[0]].map(|output| Output { glass: true, ..output });
        let through = through.into_iter().flat_map(Self::of_images).filter(|variant| variant.by_rays);
        // Views have one eye.
        let bent = Self::of_images(plain).filter(|variant| variant.by_rays);
        let bent = bent.map(|variant| Self { single_pole: true, ..variant });
        views
            .into_iter()
            .flat_map(Self::of_output)
            .chain(images.flat_map(Self::of_images))
            .chain(bent)
            .chain(through)
            .collect()
    }
}

/// The words of a batch's planes, and linear light of several positions.
pub(crate) struct Planes {
    pub words: PooledBuffer,
    position_sums: Option<PooledBuffer>,
    /// The pixels whose light is that of their first position, where light is looked up; or those of sample images that keep their
    /// samples.
    kept: Option<PooledBuffer>,
}

impl Planes {
    /// Fails for planes beyond the device's limits.
    pub fn lend(gpu: &Gpu, pool: &BufferPool, batch: &Batch<'_>) -> Result<Self, RenderError> {
        let bytes = batch.bytes(batch.output.layout().count);
        gpu.check_storage_bytes("the planes of a batch (bytes)", bytes)?;
        let is_averaged = batch.output.antialias > Antialias::NONE;
        let sum_bytes = if is_averaged { batch.bytes(3 + usize::from(batch.output.samples)) } else { 0 };
        gpu.check_storage_bytes("the sums of several samples a pixel (bytes)", sum_bytes)?;
        let sums = is_averaged.then(|| pool.lend_storage("sums of positions", sum_bytes.max(4)));
        let shares_light = is_averaged && batch.cached.is_some();
        let kept =
            (shares_light || batch.output.covered).then(|| pool.lend_storage("kept light", batch.bytes(1).max(4)));
        Ok(Self { words: pool.lend_storage("planes", bytes.max(4)), position_sums: sums, kept })
    }

    pub fn bindings(&self) -> impl Iterator<Item = Binding<'_>> {
        let position_sums = self.position_sums.as_ref().map(|sums| Binding::buffer("position_sums", sums));
        let kept = self.kept.as_ref().map(|kept| Binding::buffer("kept", kept));
        [Binding::buffer("words", &self.words)].into_iter().chain(position_sums).chain(kept)
    }
}

/// Records one dispatch for each camera.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    surfaces: &[Surfaces],
    planes: &Planes,
    reflected: Option<&Buffer>,
) -> Result<(), RenderError> {
    let batch = recording.batch;
    let variant = Finish::of(batch);
    let finish = GpuFinish {
        tone: batch.tone.into(),
        position: batch.position.number,
        position_count: batch.output.antialias.samples(),
        padding: [0; 2],
        shares: batch.work.scene.lamp_shares,
    };
    let finish = recording.gpu.buffer_with("finish", &[finish], BufferUsages::UNIFORM);
    for (camera, target) in surfaces.iter().enumerate() {
        let reflected = reflected.map(|reflected| Binding::buffer("reflected", reflected));
        let own = [Binding::buffer("finish", &finish)].into_iter().chain(reflected);
        let bound = recording.bind(&variant, (), own.chain(planes.bindings()).chain(target.bindings()))?;
        recording.dispatch(&bound, camera);
    }
    Ok(())
}
