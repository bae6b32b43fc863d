//! Views from sample sets, in batches: tile starts, the method, the fill and highlights, in one submission each.

use std::sync::Arc;

use depth_image::{DepthImage, PinholeCamera, View, ViewPlanes};
use gpu::{BufferPool, Gpu, PassCache, TablePool};

use crate::in_flight::{InFlight, Statistics};
use crate::quads::{self, MeshStatistics, Quad, QuadDrawing};
use crate::recording::{Recording, batches};
use crate::sample_set::{MAX_TABLES, SampleSet, SetDescription};
use crate::{device::Device, error::ReconstructionError, methods::ReconstructionMethod};
use crate::{fill, shaders::templates, specular, tile_start};

/// Passes for every method and number of cameras that has been asked for.
pub struct Reconstructor {
    device: Device,
    tables: TablePool,
    drawing: QuadDrawing,
}

impl Reconstructor {
    /// Pipelines are built when first used.
    ///
    /// # Errors
    /// When a shader template is broken.
    pub fn new(gpu: &Arc<Gpu>) -> Result<Self, ReconstructionError> {
        let templates = Arc::new(templates()?);
        Ok(Self {
            tables: TablePool::new(gpu, MAX_TABLES),
            drawing: QuadDrawing::new(gpu, &templates),
            device: Device { gpu: gpu.clone(), buffers: BufferPool::new(gpu), passes: PassCache::new(gpu, &templates) },
        })
    }

    /// Puts a sample set on the device.
    ///
    /// # Errors
    /// Images, cameras or a volume that cannot be used, or the device's limits.
    pub fn upload(&self, images: &[DepthImage], set: &SetDescription<'_>) -> Result<SampleSet, ReconstructionError> {
        SampleSet::upload(&self.tables, images, set)
    }

    /// One view a camera, in their order.
    ///
    /// # Errors
    /// A camera that is not valid (all are checked first), or the device.
    pub fn reconstruct(
        &self,
        set: &SampleSet,
        cameras: &[PinholeCamera],
        method: ReconstructionMethod,
        planes: ViewPlanes,
    ) -> Result<Vec<View>, ReconstructionError> {
        self.reconstruct_measured(set, cameras, method, planes, false).map(|(views, _)| views)
    }

    /// As [`Reconstructor::reconstruct`], and what it cost; counting fetches slows it down.
    ///
    /// # Errors
    /// As [`Reconstructor::reconstruct`].
    pub fn reconstruct_measured(
        &self,
        set: &SampleSet,
        cameras: &[PinholeCamera],
        method: ReconstructionMethod,
        planes: ViewPlanes,
        count_fetches: bool,
    ) -> Result<(Vec<View>, Statistics), ReconstructionError> {
        for (index, camera) in cameras.iter().enumerate() {
            camera.validate().map_err(|source| ReconstructionError::Camera { index, source })?;
        }
        let mut views = Vec::with_capacity(cameras.len());
        let mut statistics = Statistics::default();
        let mut in_flight: Option<InFlight<'_>> = None;
        // The device works on one batch while the host takes the one before apart.
        for batch in batches(cameras) {
            let recording = self.record(set, batch, method, count_fetches)?;
            if let Some(done) = in_flight.replace(InFlight::submit(recording, planes)) {
                done.finish(&mut views, &mut statistics)?;
            }
        }
        if let Some(done) = in_flight {
            done.finish(&mut views, &mut statistics)?;
        }
        statistics.fetches_per_ray = statistics.fetches_per_ray.map(|sum| sum / cameras.len().max(1) as f64);
        Ok((views, statistics))
    }

    /// All passes over a batch.
    fn record<'r>(
        &'r self,
        set: &'r SampleSet,
        cameras: &[PinholeCamera],
        method: ReconstructionMethod,
        count_fetches: bool,
    ) -> Result<Recording<'r>, ReconstructionError> {
        let mut recording = Recording::begin(&self.device, set, cameras, count_fetches)?;
        if method.follows_rays() {
            tile_start::record(&mut recording)?;
        }
        let unknown = method.record(&self.drawing, &mut recording)?;
        fill::record(&mut recording, &unknown)?;
        specular::record(&mut recording)?;
        Ok(recording)
    }

    /// Statistics of the quads that a method draws; `None` for methods that draw none.
    ///
    /// # Errors
    /// A plane that the method needs and an image lacks, or the device.
    pub fn mesh_statistics(
        &self,
        set: &SampleSet,
        method: ReconstructionMethod,
    ) -> Result<Option<MeshStatistics>, ReconstructionError> {
        Ok(method.mesh(&self.device, set)?.map(|mesh| mesh.statistics))
    }

    /// The quads that a method draws, image after image in the order of their samples; none for methods that draw none.
    ///
    /// # Errors
    /// As [`Reconstructor::mesh_statistics`].
    pub fn read_quads(&self, set: &SampleSet, method: ReconstructionMethod) -> Result<Vec<Quad>, ReconstructionError> {
        let mesh = method.mesh(&self.device, set)?;
        mesh.map_or(Ok(Vec::new()), |mesh| quads::read(&self.device, &mesh, set))
    }
}
