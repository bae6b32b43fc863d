//! The errors and the costs of one way to make views of a scene.

use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

use cluster::{BudgetMeasurement, Costs, DIRECT, MeasureCosts, Workload};
use codec::{DecodeLimits, decode_sample_image, encode_sample_image};
use depth_image::{PinholeCamera, SampleCamera, View, ViewPlanes};
use glam::UVec2;
use node::{DirectWork, Engine, SampleSet, SampleWork, SharedSet, Turn, ViewWork, own_time, push_latest};
use planner::ViewErrors;
use rayon::prelude::*;
use tonic::Status;

use crate::errors_of_views::view_errors;

/// Views of one call: other work of the device waits for a call.
const VIEWS_A_CALL: usize = 4;
/// Texels of the sample sets that are kept, beside the newest: those of about half a gigabyte.
const MOST_TEXELS: usize = 16 << 20;
/// The size in which shaders are built.
const SMALL_PX: UVec2 = UVec2::new(32, 24);
/// True views that are kept: all of a plan.
const MOST_TRUTHS: usize = 72;

/// Measures ways to make views of one scene. Work is in `turn` among other work of the device, and the time for which it waits
/// does not count.
pub(crate) struct Prober {
    engine: Arc<dyn Engine>,
    turn: Turn,
    /// Views drawn in the true light, the latest last.
    truths: VecDeque<(DirectWork, View)>,
    /// Sample sets on the device, the latest last: rows differ in quality, and share sets.
    sets: VecDeque<Sampled>,
    /// Operations whose shaders are built.
    warm: BTreeSet<String>,
}

#[derive(Clone)]
struct Sampled {
    work: SampleWork,
    set: SharedSet,
    /// g_s and d.
    sample_image_s: f64,
    load_set_s: f64,
}

/// What views are made from.
enum Source {
    Scene(Box<Workload>),
    Set { set: SharedSet, method: String },
}

impl Prober {
    pub(crate) fn new(engine: Arc<dyn Engine>, turn: Turn) -> Self {
        Self { engine, turn, truths: VecDeque::new(), sets: VecDeque::new(), warm: BTreeSet::new() }
    }

    /// The errors of views of one cell, and the costs of samples and of a view.
    pub(crate) fn probe(
        &mut self,
        request: &MeasureCosts,
        budget: &BudgetMeasurement,
        workload: &Workload,
        cameras: &[PinholeCamera],
    ) -> Result<(Vec<ViewErrors>, Costs), Status> {
        let planes = ViewPlanes { antialias: request.planes.antialias, ..ViewPlanes::COLOR };
        let mut costs = Costs::default();
        let source = if request.method == DIRECT {
            Source::Scene(Box::new(workload.clone()))
        } else {
            let sampled = self.sampled(request, workload)?;
            (costs.sample_image_s, costs.load_set_s) = (sampled.sample_image_s, sampled.load_set_s);
            Source::Set { set: sampled.set, method: request.method.clone() }
        };
        self.warm_up(&source, &cameras[..1], planes)?;
        let (views, views_s) = self.timed(|prober| prober.made(&source, cameras, planes))?;
        costs.reconstruct_view_s = views_s / cameras.len() as f64;
        let truth = Workload { lighting: budget.truth_lighting.clone(), ..workload.clone() };
        let truths = self.truths(truth, cameras, planes)?;
        let compared: Vec<_> = cameras.iter().zip(&truths).zip(&views).collect();
        let errors = compared.into_par_iter().map(|((camera, truth), view)| view_errors(camera, truth, view, None));
        let errors: Result<Vec<ViewErrors>, _> = errors.collect();
        Ok((errors.map_err(internal)?, costs))
    }

    /// Views drawn in the true light, which are kept.
    fn truths(&mut self, truth: Workload, cameras: &[PinholeCamera], planes: ViewPlanes) -> Result<Vec<View>, Status> {
        let planes = ViewPlanes { inverse_depth: true, ..planes };
        let source = Source::Scene(Box::new(truth.clone()));
        let mut truths = Vec::with_capacity(cameras.len());
        for camera in cameras {
            let work = DirectWork::of(&truth, vec![*camera], planes);
            let known = self.truths.iter().find(|(other, _)| *other == work).map(|(_, view)| view.clone());
            let view =
                known.map_or_else(|| Ok(self.made(&source, &work.cameras, planes)?.remove(0)), Ok::<_, Status>)?;
            push_latest(&mut self.truths, (work, view.clone()), MOST_TRUTHS);
            truths.push(view);
        }
        Ok(truths)
    }

    fn made(&self, source: &Source, cameras: &[PinholeCamera], planes: ViewPlanes) -> Result<Vec<View>, Status> {
        let mut views = Vec::with_capacity(cameras.len());
        for cameras in cameras.chunks(VIEWS_A_CALL) {
            views.extend(match source {
                Source::Scene(workload) => {
                    self.engine.draw_direct(&DirectWork::of(workload, cameras.to_vec(), planes), self.turn)?
                }
                Source::Set { set, method } => {
                    let work = ViewWork { cameras: cameras.to_vec(), method: method.clone(), planes };
                    self.engine.reconstruct(set.as_ref(), &work, self.turn)?
                }
            });
        }
        match views.len() == cameras.len() {
            true => Ok(views),
            false => Err(internal("the device has not made all views")),
        }
    }

    /// Builds what the first view needs, so that it is not timed: shaders, and buffers of a set.
    fn warm_up(&mut self, source: &Source, first: &[PinholeCamera], planes: ViewPlanes) -> Result<(), Status> {
        let (name, is_new_set) = match source {
            Source::Scene(workload) => (format!("{} {planes:?}", workload.lighting), false),
            Source::Set { set, method } => {
                let set = format!("{:?}", Arc::as_ptr(set).cast::<()>());
                (format!("{method} {planes:?}"), self.warm.insert(set))
            }
        };
        if self.warm.insert(name) && !is_new_set {
            self.made(source, &[first[0].resized(SMALL_PX)], planes)?;
        }
        if is_new_set {
            self.made(source, first, planes)?;
        }
        Ok(())
    }

    /// The sample set of a workload of one cell on the device, as it was kept or anew. Its images are encoded and decoded, as
    /// those of samplers are.
    fn sampled(&mut self, request: &MeasureCosts, workload: &Workload) -> Result<Sampled, Status> {
        let planes = self.engine.sample_planes(&request.method)?;
        let workload = Workload { planes, ..workload.clone() };
        let work = SampleWork::of(&workload);
        if let Some(known) = self.sets.iter().find(|sampled| sampled.work == work) {
            return Ok(known.clone());
        }
        if self.warm.insert(format!("{} {planes:?}", work.sampling)) {
            let cameras = work.cameras.iter().map(|camera| camera.resized(SMALL_PX)).collect();
            self.engine.sample(&SampleWork { cameras, ..work.clone() }, self.turn)?;
        }
        let (encoded, sampled_s) = self.timed(|prober| {
            let images = prober.engine.sample(&work, prober.turn)?;
            images.iter().map(|image| encode_sample_image(image).map_err(internal)).collect::<Result<Vec<_>, _>>()
        })?;
        let decoded = encoded.iter().zip(&work.cameras).map(|(image, camera)| {
            decode_sample_image(&image.header, camera, &image.payload, &DecodeLimits::default()).map_err(internal)
        });
        let set = SampleSet::of(&workload, decoded.collect::<Result<_, _>>()?, false).map_err(internal)?;
        let (set, load_set_s) = self.timed(|prober| Ok(prober.engine.upload(&set, prober.turn)?))?;
        let sample_image_s = sampled_s / encoded.len().max(1) as f64;
        let sampled = Sampled { work, set, sample_image_s, load_set_s };
        self.sets.push_back(sampled.clone());
        while self.sets.len() > 1 && self.sets.iter().map(Sampled::texels).sum::<usize>() > MOST_TEXELS {
            self.sets.pop_front();
        }
        Ok(sampled)
    }

    fn timed<T>(&self, run: impl FnOnce(&Self) -> Result<T, Status>) -> Result<(T, f64), Status> {
        let (done, seconds) = own_time(self.engine.as_ref(), || run(self));
        Ok((done?, seconds))
    }
}

impl Sampled {
    fn texels(&self) -> usize {
        self.work.cameras.iter().map(SampleCamera::pixel_count).sum()
    }
}

pub(crate) fn internal(error: impl ToString) -> Status {
    Status::internal(error.to_string())
}
