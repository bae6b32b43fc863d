//! One guest beside the viewer, and alone.

use app_core::exit::BadInput;
use client::Client;
use cluster::{OfferStatus, PolicyChoice};

use super::guests::Guest;
use super::viewer::{Viewer, Watched};

/// One guest's row, with medians of its repeats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    pub(super) watched: Watched,
    /// The guest's time beside the viewer, at its first visit.
    pub(super) first_s: f64,
    /// The same once all is warm.
    pub(super) beside_s: f64,
    /// The guest's time alone, with all that is made once made.
    pub(super) alone_s: f64,
}

/// Measures one guest beside the viewer, twice: its first visit has costs measured and samples taken, its second is timed.
/// Then the guest is timed alone.
///
/// # Errors
/// A client is refused, or its frames end.
pub(super) async fn measure(coordinator: &str, guest: &Guest, repeats: usize) -> anyhow::Result<Row> {
    let offers = offers(coordinator).await?;
    let mut rows = Vec::with_capacity(repeats);
    for _ in 0..repeats {
        let viewer = Viewer::start(coordinator, &offers[0], PolicyChoice::Pipeline).await?;
        let since_s = viewer.now_s();
        let visits = async {
            let first_s = guest.visit(coordinator, &offers).await?;
            Ok::<_, anyhow::Error>((first_s, guest.visit(coordinator, &offers).await?))
        };
        let visits = visits.await;
        let watched = viewer.stop(since_s).await?;
        let (first_s, beside_s) = visits?;
        rows.push(Row { watched, first_s, beside_s, alone_s: guest.visit(coordinator, &offers).await? });
    }
    Ok(median(&rows))
}

/// The scenes on offer.
pub(super) async fn offers(coordinator: &str) -> anyhow::Result<Vec<OfferStatus>> {
    let offers = Client::connect(coordinator).await?.status().await?.offers;
    if offers.len() < 2 { Err(BadInput("two scenes are needed".to_owned()).into()) } else { Ok(offers) }
}

/// The median of each figure, at least one row.
pub(super) fn median(rows: &[Row]) -> Row {
    let of = |figure: fn(&Row) -> f64| {
        let mut sorted: Vec<f64> = rows.iter().map(figure).collect();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    };
    Row {
        watched: Watched {
            longest_gap_s: of(|row| row.watched.longest_gap_s),
            shown_share: of(|row| row.watched.shown_share),
        },
        first_s: of(|row| row.first_s),
        beside_s: of(|row| row.beside_s),
        alone_s: of(|row| row.alone_s),
    }
}
