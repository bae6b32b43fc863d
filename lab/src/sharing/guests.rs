//! The clients that come beside the viewer.

use std::time::Instant;

use app_core::delivery::{open, receive, request};
use client::Client;
use cluster::{DIRECT, OfferStatus, PolicyChoice, SessionRequest, Timeline};
use glam::UVec2;

use crate::processes::orbit;

/// A guest: a batch of views, which differs from the viewer's session in one respect.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Guest {
    /// Its row in the report.
    pub(super) name: &'static str,
    /// Views of each moment.
    views: usize,
    size_px: UVec2,
    difference: Difference,
}

/// The respect in which a guest differs from the viewer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Difference {
    Size,
    Lighting,
    Codec,
    Scene,
    Moments,
    Direct,
}

const SMALL_PX: UVec2 = UVec2::new(320, 180);

/// All guests, in the order of the report.
pub(super) static GUESTS: [Guest; 6] = [
    Guest::new("32 views of 1280×720", 32, UVec2::new(1280, 720), Difference::Size),
    Guest::new("another lighting", 32, SMALL_PX, Difference::Lighting),
    Guest::new("another codec", 32, SMALL_PX, Difference::Codec),
    Guest::new("another scene", 32, SMALL_PX, Difference::Scene),
    Guest::new("8 moments", 8, SMALL_PX, Difference::Moments),
    Guest::new("4 views drawn directly", 4, SMALL_PX, Difference::Direct),
];

impl Guest {
    const fn new(name: &'static str, views: usize, size_px: UVec2, difference: Difference) -> Self {
        Self { name, views, size_px, difference }
    }

    /// Whether its views are made from the viewer's samples by the plan's policy.
    pub(super) fn shares_workload(&self) -> bool {
        matches!(self.difference, Difference::Size | Difference::Codec)
    }

    /// Opens a session, asks for all views, and gives the seconds until the last has come.
    ///
    /// # Errors
    /// The coordinator refuses, or frames are missing.
    pub(super) async fn visit(&self, coordinator: &str, offers: [&OfferStatus; 2]) -> anyhow::Result<f64> {
        let start = Instant::now();
        let offer = offers[usize::from(self.difference == Difference::Scene)];
        let views = orbit(offer, self.views, self.size_px)?;
        let client = Client::connect(coordinator).await?;
        let request = request(offer.settings.clone(), PolicyChoice::Pipeline, &views)?;
        let session = open(&client, self.request(offer, request)).await?;
        receive(&session, &views, async |_| Ok(())).await?;
        Ok(start.elapsed().as_secs_f64())
    }

    /// A guest that shares the viewer's workload forces the same policy.
    fn request(&self, offer: &OfferStatus, request: SessionRequest) -> SessionRequest {
        let request = SessionRequest { scene: Some(offer.name.clone()), ..request };
        match self.difference {
            Difference::Size | Difference::Scene => request,
            Difference::Lighting => SessionRequest { lighting: "soft 2, occlusion 2".to_owned(), ..request },
            Difference::Codec => SessionRequest { codec: "jpeg:85".to_owned(), ..request },
            Difference::Moments => {
                SessionRequest { timeline: Timeline { start_s: 0.0, step_s: 0.1, set_count: 8 }, ..request }
            }
            Difference::Direct => SessionRequest { method: DIRECT.to_owned(), ..request },
        }
    }
}
