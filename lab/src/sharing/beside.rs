//! One guest beside the viewer, and alone.

use cluster::{OfferStatus, PolicyChoice};

use super::guests::Guest;
use super::up::{Up, policies};
use super::viewer::{Viewer, Watched};
use crate::statistics::median_of;

/// The figures of one repeat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Visit {
    pub(super) watched: Watched,
    /// The guest's time beside the viewer, at its first visit.
    pub(super) first_s: f64,
    /// The same once all is warm.
    pub(super) beside_s: f64,
    /// The guest's time alone, with all that is made once made.
    pub(super) alone_s: f64,
}

/// One guest's row.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Row {
    /// The policies in force beside the guest.
    pub(super) policies: String,
    /// At least one repeat.
    pub(super) visits: Vec<Visit>,
}

/// Measures one guest beside the viewer, twice: its first visit has costs measured and samples taken, its second is timed.
/// Then the guest is timed alone.
///
/// # Errors
/// A client is refused, or its frames end.
pub(super) async fn measure(up: &Up, guest: &Guest, repeats: usize) -> anyhow::Result<Row> {
    let offers = up.two_offers()?;
    let mut in_force = String::new();
    let mut visits = Vec::with_capacity(repeats);
    for _ in 0..repeats {
        let viewer = Viewer::start(&up.coordinator, offers[0], PolicyChoice::Pipeline).await?;
        let since_s = viewer.now_s();
        let times = two_visits(&up.coordinator, guest, offers).await;
        let watched = viewer.stop(since_s).await?;
        let (first_s, beside_s, policies) = times?;
        in_force = policies;
        visits.push(Visit { watched, first_s, beside_s, alone_s: guest.visit(&up.coordinator, offers).await? });
    }
    Ok(Row { policies: in_force, visits })
}

async fn two_visits(coordinator: &str, guest: &Guest, offers: [&OfferStatus; 2]) -> anyhow::Result<(f64, f64, String)> {
    let first_s = guest.visit(coordinator, offers).await?;
    let policies = policies(coordinator).await?;
    Ok((first_s, guest.visit(coordinator, offers).await?, policies))
}

impl Row {
    /// The median of a figure of all repeats.
    pub(super) fn median(&self, figure: impl Fn(&Visit) -> f64) -> f64 {
        median_of(&self.visits, figure)
    }

    /// The longest gap of all repeats.
    pub(super) fn worst_gap_s(&self) -> f64 {
        self.visits.iter().map(|visit| visit.watched.longest_gap_s).fold(0.0, f64::max)
    }

    /// The least share of poses shown of all repeats.
    pub(super) fn worst_shown_share(&self) -> f64 {
        self.visits.iter().map(|visit| visit.watched.shown_share).fold(1.0, f64::min)
    }
}
