//! Ends of single rays, for studies and tests of how rays off mirrors are followed.

use depth_image::{
    Aabb, PinholeCamera, Provenance, ProvenanceKind, Ray, ViewPlanes, linear_from_rgb9e5, rgb9e5_from_linear,
};
use glam::{UVec2, Vec3};
use gpu::Turn;

use crate::bounce::{Bounces, CellRays, CurvedSearch, GpuMirroredRay, MirrorCell, Mirrors, follow, land};
use crate::error::ReconstructionError;
use crate::reconstructor::Reconstructor;
use crate::recording::Recording;
use crate::sample_set::SampleSet;

/// The columns of the picture by whose pixels rays are numbered.
const COLUMNS: u32 = 256;

/// Where a ray ends in images of a mirror's surroundings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayEnd {
    /// A hit; empty where the ray is proven to meet nothing, which in images of single-pole cameras is only where it never comes
    /// into the volume; filled where no image knows.
    pub kind: ProvenanceKind,
    /// From the ray's origin to a hit.
    pub way_m: f32,
    /// At a hit.
    pub color_linear: Vec3,
    /// Look-ups in images of single-pole cameras, which the twin alone counts.
    pub steps: u32,
}

/// How rays are followed.
#[derive(Clone, Copy)]
pub struct RayWork<'s> {
    /// The images.
    pub surroundings: &'s SampleSet,
    /// Nothing is met nearer to a ray's origin.
    pub near_m: f32,
    /// In images of single-pole cameras.
    pub curved_search: CurvedSearch,
    /// The side of each ray's footprint, at all places. Where it is more than 0, colours are those that a mirror shows: filtered, and
    /// with highlights. A set in which nothing reflects gives black.
    pub width_m: f32,
}

impl<'s> RayWork<'s> {
    /// Rays without width, by the usual search.
    #[must_use]
    pub fn new(surroundings: &'s SampleSet, near_m: f32) -> Self {
        Self { surroundings, near_m, curved_search: CurvedSearch::default(), width_m: 0.0 }
    }
}

impl Reconstructor {
    /// Where single rays end in images of a mirror's surroundings, followed as rays off mirrors are; also the seconds on the
    /// device. Directions are of unit length.
    ///
    /// # Errors
    /// Steps that cannot be used, too many rays, or the device.
    pub fn follow(&self, work: RayWork<'_>, rays: &[Ray]) -> Result<(Vec<RayEnd>, f64), ReconstructionError> {
        let RayWork { surroundings, near_m, curved_search, width_m } = work;
        let device = &self.device;
        let Some(first) = surroundings.cameras.first() else {
            let what = "a ray off a mirror".to_owned();
            return Err(ReconstructionError::NoSamples { what, needed: "depth images" });
        };
        let cells = [MirrorCell { bounds: Aabb::around([first.eye_in_world.into()]), surroundings }];
        let mirrors = Mirrors { cells: &cells, reflections: 1, glossy_rays: 0 };
        let size_px = UVec2::new(COLUMNS, (rays.len() as u32).div_ceil(COLUMNS).max(1));
        let camera = PinholeCamera::looking_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 1.0, size_px);
        let mut recording = Recording::begin(device, surroundings, &[camera], ViewPlanes::ALL, 0, Turn::default())?;
        let Some(bounces) = Bounces::lend(device, mirrors, camera.pixel_count(), curved_search.checked()?)? else {
            return Ok((Vec::new(), 0.0));
        };
        let mirrored = (0..).zip(rays).map(|(pixel, ray)| GpuMirroredRay {
            origin_in_world: ray.origin_in_world.to_array(),
            pixel,
            direction: ray.direction_in_world.to_array(),
            near_m,
            guess: 0,
            throughput_rgb9e5: rgb9e5_from_linear(Vec3::ONE),
            width_m,
            spread: 0.0,
        });
        let lists = bounces.listing(device, &mirrored.collect::<Vec<_>>());
        let cell_rays = CellRays { lists: &lists, next: None, cell: 0, reflection: 1 };
        follow(&mut recording, &bounces, cell_rays)?;
        if width_m > 0.0 {
            recording.frame.encoder.clear_buffer(&recording.batch.color, 0, None);
            land(&mut recording, &bounces, cell_rays)?;
        }
        let Recording { mut frame, batch, .. } = recording;
        let [color, inverse_way, provenance] = &bounces.planes;
        let color = if width_m > 0.0 { &batch.color } else { color };
        let bytes = 4 * rays.len().max(1) as u64;
        let planes = [color, inverse_way, provenance]
            .map(|plane| frame.read_back(plane, 0..bytes, device.buffers.lend_host("ends", bytes)));
        let result = frame.submit()?.wait()?;
        let [colors, inverse_ways, provenances] =
            planes.map(|plane| result.with(plane, |words: &[u32]| words[..rays.len()].to_vec()));
        let ends = colors?.into_iter().zip(inverse_ways?).zip(provenances?);
        let ends = ends.map(|((color, inverse_way), provenance)| RayEnd {
            kind: Provenance(provenance & 0xff).kind(),
            way_m: f32::from_bits(inverse_way).recip(),
            color_linear: linear_from_rgb9e5(color),
            steps: 0,
        });
        Ok((ends.collect(), result.device_s))
    }
}
