//! Audits: promises that views in force do not keep, and their replacement.

use cluster::{AuditOrder, AuditReport};
use planner::{Metric, Pricing as _, Statistic};

use super::Scheduler;
use crate::schedule::Command;
use crate::schedule::budget_state::{BudgetState, InForce};
use crate::schedule::chosen::Chosen;
use crate::schedule::findings::Broken;
use crate::schedule::representation::Representation;

/// Views that are nearer to an audited one, as a share of a view cell's side, are not audited.
const LEAST_APART: f64 = 1e-3;

impl Scheduler {
    /// How views are audited in the representation in force; `None` where nothing is promised for them.
    pub(super) fn audit_order(&self, number: u64) -> Option<AuditOrder> {
        let BudgetState { plan, in_force, .. } = self.budgets.get(&number)?;
        let audited = in_force.as_ref().filter(|in_force| in_force.audit.is_some())?;
        let term = audited.chosen.budget.error()?;
        (self.limits.audit_time_ratio > 0.0).then(|| AuditOrder {
            time_ratio: self.limits.audit_time_ratio,
            least_apart_m: LEAST_APART * f64::from(plan.cell_side_m()),
            antialias: plan.budgeted.antialias(),
            planned_pixel_count: u32::try_from(plan.budgeted.typical_view.pixel_count()).unwrap_or(u32::MAX),
            with_sample_images: term.metric() == Metric::Disocclusion,
            in_parts: term.statistic() == Statistic::Mean,
        })
    }

    /// A member has audited views.
    pub(super) fn audited(&mut self, number: u64, node: &str, report: &AuditReport) -> Vec<Command> {
        let now = self.now;
        let is_member = self.members.contains_key(node);
        let Some(state) = self.budgets.get_mut(&number).filter(|_| is_member) else { return Vec::new() };
        let Some(InForce { audit: Some(audit), plan_epoch, .. }) = &mut state.in_force else { return Vec::new() };
        let plan_epoch = *plan_epoch;
        for view in report.views.iter().filter(|view| view.plan_epoch >= plan_epoch) {
            let error = audit.excess(view).map(|ratio| audit.shown(ratio));
            state.findings.note(now, node, view, error);
        }
        let is_broken = audit.take(now, plan_epoch, report);
        if is_broken && state.broken().is_none() { self.promise_broken(number) } else { Vec::new() }
    }

    /// The next safer choice takes the place of one whose promise is broken, and a plan for the audited viewpoints follows.
    fn promise_broken(&mut self, number: u64) -> Vec<Command> {
        let now = self.now;
        let may_draw = self.may_draw_directly(number);
        let Some(state) = self.budgets.get_mut(&number) else { return Vec::new() };
        let Some(InForce { chosen, audit: Some(audit), .. }) = &state.in_force else { return Vec::new() };
        let choice_number = chosen.number;
        let row = chosen.row.as_ref().map(ToString::to_string).unwrap_or_default();
        let reason = format!("Audits found {} with {row}.", audit.finding());
        let budget = chosen.budget;
        let found_ratio = audit.found_ratio();
        state.findings.is_given_up |= state.findings.note_break(now) && may_draw;
        state.findings.broken = Some(Broken { choice_number, budget, found_ratio, since: now, reason: reason.clone() });
        state.switching = None;
        self.retreat(number, &reason)
    }

    /// Puts what is safer than the choice in force in its place: a certified row, else direct drawing, else nothing.
    pub(super) fn retreat(&mut self, number: u64, reason: &str) -> Vec<Command> {
        let may_draw = self.may_draw_directly(number);
        let next_number = self.next_choice();
        let Some(state) = self.budgets.get_mut(&number) else { return Vec::new() };
        let Some(in_force) = &state.in_force else { return Vec::new() };
        let safer = in_force.chosen.safer(next_number, reason).filter(|_| !state.findings.is_given_up);
        if let Some(safer) = safer {
            return self.measure_choice(number, safer);
        }
        if !may_draw {
            return Vec::new();
        }
        let given_up = if state.findings.is_given_up {
            " It is the third broken promise within ten minutes: views are drawn directly until the sessions end."
        } else {
            ""
        };
        let text = format!("Every view is drawn directly. {reason}{given_up}");
        let direct = in_force.chosen.direct(next_number, state.plan.prices.direct(), text);
        self.represent(number, direct, Representation::Direct)
    }

    /// A broken promise and its consequence, in words.
    pub(super) fn broken_reason(&self, broken: &Broken, state: &BudgetState) -> String {
        let since_s = self.now.saturating_sub(broken.since).as_secs();
        let next = match (&state.switching, &state.in_force) {
            (Some(Chosen { row: Some(row), .. }), _) => format!("{row} is being put in force"),
            (_, Some(in_force)) if in_force.chosen.number != broken.choice_number => {
                "What replaces it is being put in force".to_owned()
            }
            _ => "Nothing safer is certified; a plan for the audited viewpoints follows".to_owned(),
        };
        format!("{} It has been broken for {since_s} s. {next}.", broken.reason)
    }

    fn may_draw_directly(&self, number: u64) -> bool {
        self.workloads.get(&number).is_some_and(|w| w.sessions.policy_override().may_draw_directly())
    }

    /// Follows viewers who stay where the error is above the budget, and forgets promises that are replaced.
    pub(super) fn follow_audits(&mut self) {
        let now = self.now;
        for (number, state) in &mut self.budgets {
            let Some(workload) = self.workloads.get(number) else { continue };
            let least_apart_m = LEAST_APART as f32 * state.plan.cell_side_m();
            state.findings.follow_viewers(now, |node, camera| workload.is_viewed_from(node, camera, least_apart_m));
            if state.broken().is_none() {
                state.findings.broken = None;
            }
        }
    }
}
