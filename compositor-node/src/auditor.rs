//! Audits: some of the views of a plan with a promise are made again, drawn directly as well, and compared.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::sync::Arc;
use std::time::Instant;

use cluster::{Assignment, AuditOrder, AuditedView, MOST_PLANNED_PIXELS, ViewErrors};
use depth_image::{ViewPart, ViewPlanes};
use glam::UVec2;
use node::{DirectWork, NodeParts, Pinned, Reason, ViewAudit, ViewProbes, ViewWork, blocking};
use parking_lot::Mutex;
use tonic::Status;

use crate::audit_choice::{AuditChoice, Candidate, Ended, Kind};
use crate::batch::{BatchKey, Source, Waiting};
use crate::sets::{ReadySet, ViewSets};

/// Larger views are compared in a part.
const MOST_WHOLE_PIXELS: u32 = 320 * 240;
/// The sides of a part.
const PART_PX: u32 = 128;

/// The audits of one compositor. One is under way at a time.
pub(crate) struct Auditor {
    pub(crate) node: Arc<NodeParts>,
    pub(crate) probes: Arc<dyn ViewProbes>,
    pub(crate) choice: Mutex<AuditChoice>,
}

/// A view that is to be audited.
struct ChosenView {
    plan: Arc<Assignment>,
    set: Pinned<ReadySet>,
    view: Candidate,
    scene_time_s: f32,
}

impl Auditor {
    /// Takes note of views that were made together, and begins the audit of one of them where that is due.
    pub(crate) fn note(self: &Arc<Self>, made: &[Waiting]) {
        let Some(key) = made.first().map(|waiting| &waiting.key) else { return };
        let Some(plan) = self.node.plans.in_force(key.workload_number) else { return };
        let Some(order) = plan.audit.filter(|_| key.sample_set_id.plan_epoch == plan.plan_epoch) else { return };
        let mut covered = Vec::new();
        for waiting in made {
            match uncovered(&plan, &order, waiting) {
                None => covered.push(waiting),
                Some(reason) => {
                    self.node.metrics.uncovered_views.get_or_create(&Reason { reason }).inc();
                }
            }
        }
        let counts = [covered.len(), made.len() - covered.len()].map(|count| count as u64);
        self.node.metrics.done.covered(plan.workload_number, counts);
        if let Some(chosen) = self.choose(&plan, &order, &covered) {
            tokio::spawn(self.clone().audit(chosen, order));
        }
    }

    /// The views are of one set, as views that are made together are.
    fn choose(&self, plan: &Arc<Assignment>, order: &AuditOrder, covered: &[&Waiting]) -> Option<ChosenView> {
        let first = covered.first()?;
        let Source::Sets(ViewSets { of_cell: set, .. }) = &first.set.source else { return None };
        let scene_time_s = plan.workload.timeline.time_s(set_index(&first.key))?;
        let candidates = covered.iter().map(|waiting| {
            let stream = waiting.reply.outbox().stream;
            let random = random([plan.plan_epoch, stream, waiting.view.frame]);
            Candidate { stream, random, set: set.content, camera: waiting.view.camera }
        });
        let candidates: Vec<Candidate> = candidates.collect();
        let mut choice = self.choice.lock();
        let place = choice.choose(Instant::now(), &kind_of(plan), &candidates, order.least_apart_m as f32)?;
        Some(ChosenView { plan: plan.clone(), set: set.clone(), view: candidates[place], scene_time_s })
    }

    async fn audit(self: Arc<Self>, chosen: ChosenView, order: AuditOrder) {
        let Candidate { stream, random, camera, .. } = chosen.view;
        let Assignment { plan_epoch, workload_number, .. } = *chosen.plan;
        let kind = kind_of(&chosen.plan);
        let part = audited_part(camera.size_px, &order, random);
        let is_part = part != ViewPart::whole(camera.size_px);
        let start = Instant::now();
        // Whatever becomes of the task, the next audit follows.
        let compared = tokio::spawn(self.clone().compare(chosen, order, part)).await;
        let compared = compared.unwrap_or_else(|error| Err(Status::internal(error.to_string())));
        let busy_s = match compared {
            Ok((errors, busy_s)) => {
                let view = AuditedView { plan_epoch, stream, camera, errors, is_part };
                self.node.metrics.done.audited(workload_number, view, busy_s);
                self.node.metrics.audited_views.inc();
                self.node.metrics.audit_s.inc_by(busy_s);
                Some(busy_s)
            }
            Err(status) => {
                tracing::debug!(reason = status.message(), "a view is not audited");
                self.node.metrics.failed_audits.inc();
                None
            }
        };
        let share = order.time_ratio.min(self.node.config.direct_share);
        // Another number: the chosen one is the least of several.
        let random = self::random([random, workload_number, plan_epoch]);
        let ended = Ended { kind, busy_s, wall_s: start.elapsed().as_secs_f64(), random };
        self.choice.lock().end(Instant::now(), ended, share);
    }

    async fn compare(
        self: Arc<Self>,
        chosen: ChosenView,
        order: AuditOrder,
        part: ViewPart,
    ) -> Result<(ViewErrors, f64), Status> {
        let ChosenView { plan, set, view: Candidate { camera, .. }, scene_time_s } = chosen;
        let scene = &plan.workload.scene;
        if !self.node.engine.has_scene(scene.hash.as_str()) {
            // Loading may take minutes: the set is not kept for it.
            drop(set);
            self.node.ensure_scene(scene).await?;
            return Err(Status::unavailable("the scene was not loaded"));
        }
        // As a certificate's views are: without the exposure and the curve of a client.
        let planes = ViewPlanes { antialias: order.antialias, ..ViewPlanes::COLOR };
        let direct = DirectWork::of(&plan.workload, vec![camera], ViewPlanes { inverse_depth: true, ..planes });
        let view = ViewAudit {
            set: set.set.clone(),
            sample_images: set.sample_images.clone(),
            pinned: Box::new(set),
            view: ViewWork { cameras: vec![camera], method: plan.method.clone().unwrap_or_default(), planes },
            part,
            direct: DirectWork { scene_time_s, ..direct },
        };
        let probes = self.probes.clone();
        blocking(move || probes.audit(view)).await
    }
}

fn kind_of(plan: &Assignment) -> Kind {
    (plan.workload_number, plan.method.clone().unwrap_or_default())
}

/// The part of a view that is compared. The square with a random pixel has the view's errors in the mean.
fn audited_part(view_px: UVec2, order: &AuditOrder, random: u64) -> ViewPart {
    if !order.in_parts || view_px.element_product() <= MOST_WHOLE_PIXELS {
        return ViewPart::whole(view_px);
    }
    // Another number: the view was chosen because its own is the least.
    let pixel = self::random([random, 0, 1]) % u64::from(view_px.element_product());
    let pixel = UVec2::new(pixel as u32 % view_px.x, pixel as u32 / view_px.x);
    ViewPart::square_of(pixel, PART_PX, view_px)
}

/// Why a promise is not for a view; `None` where it is.
fn uncovered(plan: &Assignment, order: &AuditOrder, waiting: &Waiting) -> Option<&'static str> {
    let key = &waiting.key;
    let Source::Sets(ViewSets { of_cell: set, .. }) = &waiting.set.source else { return Some("drawn directly") };
    let pixels = f64::from(key.size_px.element_product()) / f64::from(order.planned_pixel_count);
    let refinement = plan.workload.refinement(set_index(key));
    let reasons = [
        (Some(&key.method) != plan.method.as_ref(), "another method"),
        (waiting.set.place.is_neighbour, "another view cell's set"),
        (refinement.step + 1 < refinement.steps, "unfinished light"),
        (key.planes.antialias != order.antialias, "other samples a pixel"),
        (!(MOST_PLANNED_PIXELS.recip()..=MOST_PLANNED_PIXELS).contains(&pixels), "another size"),
        (order.with_sample_images && set.sample_images.is_empty(), "a set of an earlier plan"),
    ];
    reasons.into_iter().find_map(|(applies, reason)| applies.then_some(reason))
}

fn set_index(key: &BatchKey) -> u32 {
    u32::try_from(key.sample_set_id.index).unwrap_or(u32::MAX)
}

/// The same numbers give the same on every node and in every run.
fn random(numbers: [u64; 3]) -> u64 {
    let mut hasher = DefaultHasher::new();
    numbers.hash(&mut hasher);
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use depth_image::Antialias;

    use super::*;

    fn order(in_parts: bool) -> AuditOrder {
        let antialias = Antialias::NONE;
        let planned_pixel_count = 1;
        AuditOrder {
            time_ratio: 0.01,
            least_apart_m: 0.0,
            antialias,
            planned_pixel_count,
            with_sample_images: false,
            in_parts,
        }
    }

    #[test]
    fn every_pixel_of_a_large_view_is_compared_equally_often() {
        let view_px = UVec2::new(640, 360);
        let parts = (0..20_000).map(|number| audited_part(view_px, &order(true), number));
        // The lower right square has 128 x 104 pixels.
        let last = parts.filter(|part| part.first_px == UVec2::new(512, 256)).count() as f64;
        let expected = 20_000.0 * 128.0 * 104.0 / (640.0 * 360.0);
        assert!((last / expected - 1.0).abs() < 0.1, "{last} of {expected}");
    }

    #[test]
    fn small_views_and_those_of_a_promise_for_single_views_are_compared_as_a_whole() {
        let small = UVec2::new(320, 240);
        let large = UVec2::new(640, 480);
        assert_eq!(audited_part(small, &order(true), 1), ViewPart::whole(small));
        assert_eq!(audited_part(large, &order(false), 1), ViewPart::whole(large));
        assert_eq!(audited_part(large, &order(true), 1).size_px.max_element(), PART_PX);
    }
}
