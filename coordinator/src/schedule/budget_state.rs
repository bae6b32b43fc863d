//! A workload's budget: the last plan for it, and the choice in force.

use std::time::Duration;

use planner::{Budget, PromiseState};

use super::budget_plan::BudgetPlan;
use super::chosen::Chosen;
use super::findings::{Broken, Findings};
use super::prices::EqualNodes;
use super::promise_audit::PromiseAudit;

/// The state of a workload's budget.
#[derive(Debug, Clone)]
pub(super) struct BudgetState {
    pub(super) plan: BudgetPlan,
    pub(super) in_force: Option<InForce>,
    /// A row whose costs are measured before it is in force.
    pub(super) switching: Option<Chosen>,
    /// The choice could not be put in force, for a reason that may pass.
    pub(super) is_to_be_tried_again: bool,
    pub(super) findings: Findings,
    /// Budgets that plans have found to be kept by nothing.
    unreachable: Vec<Unreachable>,
}

/// A budget that nothing keeps.
#[derive(Debug, Clone)]
pub(super) struct Unreachable {
    pub(super) budget: Budget,
    pub(super) since: Duration,
    /// The prices of the plan that found it.
    pub(super) prices: EqualNodes,
    /// Another plan would find the same.
    pub(super) is_final: bool,
    pub(super) reason: String,
}

/// A choice in force.
#[derive(Debug, Clone)]
pub(super) struct InForce {
    pub(super) chosen: Chosen,
    pub(super) since: Duration,
    /// The first plan with it, and whether nodes and sessions have that plan.
    pub(super) plan_epoch: u64,
    pub(super) is_applied: bool,
    /// The audits of its views, where it has a certificate.
    pub(super) audit: Option<PromiseAudit>,
}

impl BudgetState {
    /// With another plan than before. A choice of that plan that is not in force yet is given up.
    pub(super) fn begin(plan: BudgetPlan, before: Option<Self>) -> Self {
        let Some(Self { plan: last, in_force, switching, mut findings, mut unreachable, .. }) = before else {
            let (in_force, switching, findings, unreachable) = Default::default();
            return Self { plan, in_force, switching, is_to_be_tried_again: false, findings, unreachable };
        };
        let switching = switching.filter(|chosen| chosen.number != last.number);
        findings.is_to_be_planned = false;
        unreachable.retain(|known| !plan.budget.implies(&known.budget));
        Self { plan, in_force, switching, is_to_be_tried_again: false, findings, unreachable }
    }

    /// Nothing keeps a budget. What is known of stricter ones says no more.
    pub(super) fn note_unreachable(&mut self, known: Unreachable) {
        self.unreachable.retain(|other| !other.budget.implies(&known.budget));
        self.unreachable.push(known);
    }

    /// The knowledge that nothing keeps a budget.
    pub(super) fn unreachable_by(&self, budget: &Budget) -> Option<&Unreachable> {
        self.unreachable.iter().find(|known| budget.implies(&known.budget))
    }

    /// Whether the choice in force keeps a budget, as far as plans and audits know.
    pub(super) fn keeps(&self, budget: &Budget) -> bool {
        let Some(InForce { chosen, .. }) = &self.in_force else { return false };
        let is_promised = chosen.outcome.state == PromiseState::Kept && chosen.budget.implies(budget);
        let is_broken = self.broken().is_some_and(|broken| broken.is_of(budget));
        is_promised && !is_broken && self.unreachable_by(&chosen.budget).is_none()
    }

    /// Whether the plan began before the last promise was broken: it does not know the audited viewpoints.
    pub(super) fn is_superseded(&self) -> bool {
        self.findings.is_given_up || self.findings.breaks.last().is_some_and(|at| self.plan.began < *at)
    }

    /// The choice in force, chosen again. Its audits go on, unless its promise is broken or another.
    pub(super) fn again(&mut self, now: Duration, chosen: Chosen) -> InForce {
        let is_broken = self.broken().is_some();
        let again = InForce::begin(now, chosen);
        let Some(before) = self.in_force.take() else { return again };
        let is_same = before.chosen.row == again.chosen.row && before.chosen.budget == again.chosen.budget;
        let audit = if is_same && !is_broken && again.audit.is_some() { before.audit } else { again.audit };
        InForce { plan_epoch: before.plan_epoch, audit, chosen: again.chosen, since: again.since, is_applied: true }
    }

    /// The broken promise, until another choice is in force and applied.
    pub(super) fn broken(&self) -> Option<&Broken> {
        self.findings.broken.as_ref().filter(|broken| {
            let other = self.in_force.as_ref().filter(|in_force| in_force.chosen.number != broken.choice_number);
            other.is_none_or(|in_force| !in_force.is_applied)
        })
    }
}

impl InForce {
    /// A choice that is in force from now on.
    pub(super) fn begin(now: Duration, chosen: Chosen) -> Self {
        let certificate = chosen.outcome.certificate.as_ref().filter(|_| chosen.row.is_some());
        let audit = chosen.budget.error().zip(certificate).map(|(term, of)| PromiseAudit::begin(now, term, of));
        Self { chosen, since: now, plan_epoch: 0, is_applied: true, audit }
    }
}
