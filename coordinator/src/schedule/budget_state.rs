//! A workload's budget: its plan, the choice in force, and what audits have found.

use std::collections::BTreeMap;
use std::time::Duration;

use cluster::{AuditReport, Costs, SamplePlanes};
use planner::{Demand, Probe, ProbeId, Probed, TestedError};

use super::budget_plan::BudgetPlan;
use super::promise_audit::PromiseAudit;
use super::representation::Representation;
use super::workload_state::WorkloadState;

/// A still set serves a viewer for this time, as far as costs are concerned.
pub const STILL_SET_S: f64 = 60.0;
/// A measurement is asked for again after this pause, and fails after this number of lost nodes.
const PAUSE: Duration = Duration::from_secs(1);
const MOST_LOST: u32 = 5;

/// The state of a workload's budget.
#[derive(Debug, Clone)]
pub(super) struct BudgetState {
    pub(super) plan: BudgetPlan,
    /// Planes of sample images that the rows need, as measured.
    planes: BTreeMap<usize, SamplePlanes>,
    not_before: Duration,
    lost: u32,
    pub(super) choice: Option<Choice>,
    /// The promise that audits have found to be broken, until another row is in force.
    pub(super) broken: Option<Broken>,
}

/// The row that the plan chose, or one that replaced it when its promise was broken.
#[derive(Debug, Clone)]
pub(super) struct Choice {
    /// The place of the row; `None` where nothing keeps the budget.
    pub(super) row: Option<usize>,
    pub(super) tested: Option<TestedError>,
    pub(super) reason: String,
    /// The first plan with it, and whether nodes and sessions have that plan.
    pub(super) plan_epoch: u64,
    pub(super) is_applied: bool,
    /// The audits of its views, where it has an error.
    pub(super) audit: Option<PromiseAudit>,
}

/// The finding of audits, in words.
#[derive(Debug, Clone)]
pub(super) struct Broken {
    pub(super) since: Duration,
    pub(super) reason: String,
}

impl BudgetState {
    pub(super) fn new(plan: BudgetPlan) -> Self {
        Self { plan, planes: BTreeMap::new(), not_before: Duration::ZERO, lost: 0, choice: None, broken: None }
    }

    /// The measurement that is due.
    pub(super) fn due_probe(&mut self, now: Duration) -> Option<Probe> {
        let is_due = now >= self.not_before;
        self.plan.planner.next_probe().filter(|_| is_due)
    }

    /// A node has measured views. The row of an impossible answer has failed.
    pub(super) fn measured(&mut self, probed: &Probed, planes: SamplePlanes) {
        let asked = self.plan.planner.next_probe().filter(|probe| probe.id == probed.id);
        self.planes.extend(asked.map(|probe| (probe.row, planes)));
        let _ = self.plan.planner.answer(probed);
    }

    /// A node was lost while it measured. The row fails where that happens again and again.
    pub(super) fn lose(&mut self, now: Duration, id: ProbeId) {
        self.lost += 1;
        self.not_before = now + PAUSE;
        if self.lost >= MOST_LOST {
            self.lost = 0;
            self.plan.planner.fail(id);
        }
    }

    /// The choice of the plan, once that is made.
    pub(super) fn chosen(&self) -> Option<Choice> {
        let outcome = self.plan.planner.outcome()?;
        Some(self.choice_of(outcome.kept.first().copied(), outcome.reason.clone()))
    }

    /// The choice in place of one whose promise is broken: the cheapest row that was tested to be more accurate, else drawing
    /// directly.
    pub(super) fn safer(&self, reason: &str) -> Option<Choice> {
        let broken = self.choice.as_ref()?.tested?;
        let mut kept = self.plan.planner.outcome()?.kept.iter().copied();
        let row = kept.find(|&row| self.tested(row).is_none_or(|tested| tested.mean_ratio < broken.mean_ratio))?;
        Some(self.choice_of(Some(row), format!("{} took its place. {reason}", self.plan.row(row)?)))
    }

    fn choice_of(&self, row: Option<usize>, reason: String) -> Choice {
        let tested = row.and_then(|row| self.tested(row));
        let audit = tested.map(|tested| PromiseAudit::new(self.plan.budgeted.budget, &tested));
        Choice { row, tested, reason, plan_epoch: 0, is_applied: true, audit }
    }

    /// The test of a row; `None` for drawing directly with all rays, which has no error.
    fn tested(&self, row: usize) -> Option<TestedError> {
        let is_exact = self.plan.planner.request().exact == Some(row);
        self.plan.planner.summary(row).and_then(|summary| summary.tested).filter(|_| !is_exact)
    }

    /// A row as it is put in force; `asked` are the costs of what sessions ask for.
    pub(super) fn representation(&self, row: usize, asked: &Costs) -> Option<Representation> {
        let costs = self.plan.planner.costs(row)?;
        let planes = self.planes.get(&row).copied().unwrap_or_default();
        Some(Representation::new(self.plan.row(row)?.clone(), &costs, planes, asked))
    }

    /// Takes note of audited views; the finding where they break the promise.
    pub(super) fn audited(&mut self, now: Duration, report: &AuditReport) -> Option<String> {
        let Choice { row, plan_epoch, audit, .. } = self.choice.as_mut()?;
        let audit = audit.as_mut()?;
        if !audit.take(*plan_epoch, report) || self.broken.is_some() {
            return None;
        }
        let name = row.and_then(|row| self.plan.row(row)).map(ToString::to_string).unwrap_or_default();
        let reason = format!("Audits found {} with {name}.", audit.finding());
        self.broken = Some(Broken { since: now, reason: reason.clone() });
        Some(reason)
    }
}

/// The work that a workload's views are part of.
pub(super) fn demand(workload: &WorkloadState) -> Demand {
    let shown = (workload.sessions.views_per_s() * STILL_SET_S) as usize;
    let is_still = !workload.requested.timeline.moves();
    let views_a_set = if is_still { workload.sessions.views_at_once() + shown } else { workload.load().views };
    Demand {
        nodes: workload.nodes.len().max(1),
        cells: workload.requested.view_cell_count().max(1),
        views_a_set: views_a_set.max(1),
    }
}
