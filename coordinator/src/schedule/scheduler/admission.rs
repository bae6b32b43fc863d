//! Whether what sessions ask for can be met at all.

use cluster::limits::MAX_CELLS;
use depth_image::PinholeCamera;

use super::Scheduler;
use crate::schedule::choose::{Demand, check};
use crate::schedule::work::Work;
use crate::schedule::{ChoiceError, NodeCosts, Opening, choose};

/// Of the nodes' time, at the least that sessions make do with: what is measured alone and in even batches takes longer among
/// many viewers.
const MOST_ADMITTED: f64 = 0.9;

impl Scheduler {
    pub(super) fn check(&self, opening: &Opening) -> Result<(), ChoiceError> {
        let shared = self.work.as_ref().filter(|work| work.suits(opening));
        let mut work = shared.cloned().unwrap_or_else(|| Work::new(opening));
        work.add(opening);
        if shared.is_some() {
            return admit(&work, &self.costs_now());
        }
        let alone = NodeCosts { costs: opening.costs, ..NodeCosts::default() };
        let counting = self.members.values().filter(|member| self.counts(member, opening)).count();
        admit(&work, &vec![alone; counting])
    }

    /// Whether a session has been heard of and not ended.
    #[must_use]
    pub fn has_session(&self, session: u64) -> bool {
        self.work.as_ref().is_some_and(|work| work.sessions().contains(&session))
    }

    /// Whether a session may ask for so much from now on. Less than before it always may.
    ///
    /// # Errors
    /// As for one that is opened.
    pub fn admits(&self, session: u64, views_per_set: usize, frames_per_s: f64) -> Result<(), ChoiceError> {
        let Some(before) = &self.work else { return Ok(()) };
        let mut work = before.clone();
        work.demand(session, views_per_set, frames_per_s);
        if work.views_per_s() <= before.views_per_s() {
            return Ok(());
        }
        admit(&work, &self.costs_now())
    }

    /// Whether a session may look from elsewhere from now on.
    ///
    /// # Errors
    /// As for one that is opened, and for one that has sample cameras of its own.
    pub fn admits_views(&self, session: u64, viewpoints: &[PinholeCamera]) -> Result<(), ChoiceError> {
        let Some(before) = &self.work else { return Ok(()) };
        let mut work = before.clone();
        work.look(session, viewpoints);
        match work.cell_count() {
            None => Err(ChoiceError::NoCells { session }),
            Some(cells) if cells > MAX_CELLS && Some(cells) > before.cell_count() => Err(ChoiceError::Cells { cells }),
            Some(_) => Ok(()),
        }
    }
}

/// Whether a demand can be met at all; of sessions with a rate, at the least that they make do with.
fn admit(work: &Work, nodes: &[NodeCosts]) -> Result<(), ChoiceError> {
    let demand = Demand { load: work.load(), nodes, wish: work.wish(), present: None };
    check(&demand)?;
    if let Some(cells) = work.cell_count().filter(|&cells| cells > MAX_CELLS) {
        return Err(ChoiceError::Cells { cells });
    }
    let least_ratio = work.fallbacks().last().map_or(1.0, |quality| quality.frame_rate_ratio);
    let needed = work.utilisation(choose(&demand)?.time_s()) * least_ratio / work.frame_rate_ratio();
    if needed > MOST_ADMITTED { Err(ChoiceError::Overload { needed }) } else { Ok(()) }
}
