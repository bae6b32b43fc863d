//! Audits: some of the views of a plan with a promise are made again, drawn directly as well, and compared.
//!
//! After an audit comes a random pause, whose mean gives audits their share of the time. The next audit is of a view that is
//! made after it, and is chosen at random from those that were made together, whatever they show.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::sync::Arc;
use std::time::{Duration, Instant};

use cluster::{Assignment, AuditOrder, AuditedView, MOST_PLANNED_PIXELS, Policy, ViewErrors, Workload};
use depth_image::{PinholeCamera, ViewPart, ViewPlanes};
use glam::UVec2;
use node::{DirectWork, MadeView, NodeParts, Reason, ViewAudit, ViewProbes, ViewWork, blocking};
use parking_lot::Mutex;
use tonic::Status;

use crate::batch::{BatchKey, Source, Waiting};
use crate::sets::ViewSets;

/// Larger views are compared in a part.
const MOST_WHOLE_PIXELS: u32 = 320 * 240;
/// The sides of a part.
const PART_PX: u32 = 128;
/// The pause after the first audit of a plan, which may have built shaders.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
/// The pause after a failure.
const FAILED_PAUSE: Duration = Duration::from_secs(10);

/// The audits of one compositor. One is under way at a time.
pub(crate) struct Auditor {
    pub(crate) node: Arc<NodeParts>,
    pub(crate) probes: Arc<dyn ViewProbes>,
    pub(crate) schedule: Mutex<AuditSchedule>,
}

/// When the next audit may begin.
#[derive(Debug, Default)]
pub(crate) struct AuditSchedule {
    is_auditing: bool,
    due: Option<Instant>,
    /// The plan of the last audit that did not fail.
    last_plan: u64,
}

/// A view that is to be audited, and what it was made from.
struct ChosenView {
    plan: Arc<Assignment>,
    order: AuditOrder,
    source: Source,
    set_index: u32,
    camera: PinholeCamera,
    part: ViewPart,
}

impl Auditor {
    /// Takes note of views that were made together, and begins the audit of one of them where that is due.
    pub(crate) fn note(self: &Arc<Self>, made: &[Waiting]) {
        let Some(key) = made.first().map(|waiting| &waiting.key) else { return };
        let Some(plan) = self.node.plans.in_force(key.workload_number) else { return };
        let order = plan.audit.clone().filter(|_| key.sample_set_id.plan_epoch == plan.plan_epoch);
        let Some(order) = order else { return };
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
        let random_of =
            |waiting: &&Waiting| random([plan.plan_epoch, waiting.reply.outbox().stream, waiting.view.frame]);
        let Some(chosen) = covered.into_iter().min_by_key(random_of) else { return };
        if self.schedule.lock().begin(Instant::now()) {
            let random = random_of(&chosen);
            let camera = chosen.view.camera;
            tokio::spawn(self.clone().audit(
                ChosenView {
                    order,
                    source: chosen.set.source.clone(),
                    set_index: set_index(key),
                    part: audited_part(camera.size_px, random),
                    camera,
                    plan,
                },
                random,
            ));
        }
    }

    async fn audit(self: Arc<Self>, chosen: ChosenView, random: u64) {
        let Assignment { plan_epoch, workload_number, .. } = *chosen.plan;
        let ChosenView { camera, part, .. } = chosen;
        let share = chosen.order.time_ratio.min(self.node.config.direct_share);
        // Whatever becomes of the task, the next audit follows.
        let compared = tokio::spawn(self.clone().compare(chosen)).await;
        let compared = compared.unwrap_or_else(|error| Err(Status::internal(error.to_string())));
        let metrics = &self.node.metrics;
        match &compared {
            Ok((errors, busy_s)) => {
                let is_part = part != ViewPart::whole(camera.size_px);
                let view = AuditedView { plan_epoch, errors: *errors, is_part };
                metrics.done.audited(workload_number, view);
                metrics.audited_views.inc();
                metrics.audit_s.inc_by(*busy_s);
            }
            Err(status) => {
                tracing::debug!(reason = status.message(), "a view is not audited");
                metrics.failed_audits.inc();
            }
        }
        // Another number: the chosen one is the least of several.
        let random = self::random([random, workload_number, plan_epoch]);
        let busy_s = compared.ok().map(|(_, busy_s)| busy_s);
        self.schedule.lock().end(Instant::now(), plan_epoch, busy_s.map(|busy_s| random_pause(busy_s, share, random)));
    }

    async fn compare(self: Arc<Self>, chosen: ChosenView) -> Result<(ViewErrors, f64), Status> {
        let ChosenView { plan, order, source, set_index, camera, part, .. } = chosen;
        let scene = &plan.workload.scene;
        if !self.node.engine.has_scene(scene.hash.as_str()) {
            // Loading may take minutes: the set is not kept for it.
            drop(source);
            self.node.ensure_scene(scene).await?;
            return Err(Status::unavailable("the scene was not loaded"));
        }
        // As the views of plans are: without the exposure and the curve of a client.
        let planes = ViewPlanes { antialias: order.antialias, ..ViewPlanes::COLOR };
        let time_s = plan.workload.timeline.time_s(set_index);
        let scene_time_s = time_s.ok_or_else(|| Status::out_of_range("the set is beyond the timeline"))?;
        let drawn = DirectWork { scene_time_s, ..DirectWork::of(&plan.workload, vec![camera], planes) };
        let truth = Workload { lighting: order.truth_lighting, ..plan.workload.clone() };
        let truth_planes = ViewPlanes { inverse_depth: true, ..planes };
        let truth = DirectWork { scene_time_s, ..DirectWork::of(&truth, vec![camera], truth_planes) };
        let made = match source {
            Source::Sets(ViewSets { of_cell: set, .. }) => {
                let method = plan.method.clone().unwrap_or_default();
                let view = ViewWork { cameras: vec![camera], method, planes };
                MadeView::FromSet { set: set.set.clone(), pinned: Box::new(set), view }
            }
            Source::Scene { .. } => MadeView::Direct(drawn),
        };
        let probes = self.probes.clone();
        blocking(move || probes.audit(ViewAudit { made, camera, part, truth })).await
    }
}

impl AuditSchedule {
    /// Whether an audit may begin now. It is then under way until [`AuditSchedule::end`].
    fn begin(&mut self, now: Instant) -> bool {
        let is_free = !self.is_auditing && self.due.is_none_or(|due| now >= due);
        self.is_auditing |= is_free;
        is_free
    }

    /// An audit has ended; without a pause, it has failed.
    fn end(&mut self, now: Instant, plan_epoch: u64, pause: Option<Duration>) {
        self.is_auditing = false;
        let pause = pause.map_or(FAILED_PAUSE, |pause| {
            let is_first = std::mem::replace(&mut self.last_plan, plan_epoch) != plan_epoch;
            if is_first { FIRST_PAUSE } else { pause }
        });
        self.due = Some(now + pause);
    }
}

/// A pause after work of `busy_s` that takes `share` of the time in the mean. It is exponential: an even one could keep step
/// with a path that repeats.
fn random_pause(busy_s: f64, share: f64, random: u64) -> Duration {
    // Above 0 and at most 1.
    let unit = ((random >> 11) + 1) as f64 / (1_u64 << 53) as f64;
    Duration::try_from_secs_f64(busy_s * (share.recip() - 1.0) * -unit.ln()).unwrap_or(FAILED_PAUSE)
}

/// The part of a view that is compared. The square with a random pixel has the view's errors in the mean.
fn audited_part(view_px: UVec2, random: u64) -> ViewPart {
    if view_px.element_product() <= MOST_WHOLE_PIXELS {
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
    let pixels = f64::from(key.size_px.element_product()) / f64::from(order.planned_pixel_count);
    let refinement = plan.workload.refinement(set_index(key));
    let is_direct = matches!(waiting.set.source, Source::Scene { .. });
    let reasons = [
        (is_direct != (plan.policy == Policy::Direct), "drawn directly"),
        (!is_direct && Some(&key.method) != plan.method.as_ref(), "another method"),
        (waiting.set.place.is_neighbour, "another view cell's set"),
        (!is_direct && refinement.step + 1 < refinement.steps, "unfinished light"),
        (key.planes.antialias != order.antialias, "other samples a pixel"),
        (!(MOST_PLANNED_PIXELS.recip()..=MOST_PLANNED_PIXELS).contains(&pixels), "another size"),
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
    use super::*;

    #[test]
    fn every_pixel_of_a_large_view_is_compared_equally_often_and_small_views_are_compared_whole() {
        let view_px = UVec2::new(640, 360);
        let parts = (0..20_000).map(|number| audited_part(view_px, number));
        // The lower right square has 128 x 104 pixels.
        let last = parts.filter(|part| part.first_px == UVec2::new(512, 256)).count() as f64;
        let expected = 20_000.0 * 128.0 * 104.0 / (640.0 * 360.0);
        assert!((last / expected - 1.0).abs() < 0.1, "{last} of {expected}");
        let small = UVec2::new(320, 240);
        assert_eq!(audited_part(small, 1), ViewPart::whole(small));
    }

    #[test]
    fn audits_take_their_share_of_the_time_in_the_mean() {
        let number = |place: u64| place.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let pauses_s = (0..10_000).map(|place| random_pause(0.03, 0.01, number(place)).as_secs_f64());
        let mean_s = pauses_s.sum::<f64>() / 10_000.0;
        assert!((0.03 / (0.03 + mean_s) / 0.01 - 1.0).abs() < 0.02, "{mean_s}");
        assert!(random_pause(1.0, 0.5, u64::MAX).is_zero());
    }

    #[test]
    fn one_audit_is_under_way_and_a_pause_follows() {
        let mut schedule = AuditSchedule::default();
        let now = Instant::now();
        let pause = Duration::from_secs(7);
        assert!(schedule.begin(now) && !schedule.begin(now), "one at a time");
        schedule.end(now, 3, Some(pause));
        assert!(!schedule.begin(now) && schedule.begin(now + FIRST_PAUSE), "the first may have built shaders");
        schedule.end(now, 3, Some(pause));
        assert!(!schedule.begin(now + FIRST_PAUSE) && schedule.begin(now + pause));
        schedule.end(now, 3, None);
        assert!(!schedule.begin(now + pause) && schedule.begin(now + FAILED_PAUSE), "it has failed");
    }
}
