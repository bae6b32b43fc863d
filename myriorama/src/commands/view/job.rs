//! A request for views, as arguments and the coordinator's offer determine it.

use std::sync::Arc;
use std::time::Duration;

use anyhow::Context as _;
use app_core::delivery::{Terms, at_rate, open, request, viewpoints};
use app_core::exit::BadInput;
use app_core::print_line;
use client::{Client, Session};
use cluster::{BudgetRequest, OfferSettings, OfferStatus, PromiseState, SessionRequest, Timeline};
use depth_image::PinholeCamera;
use indicatif::ProgressBar;

use super::args::ViewArgs;
use super::file_names::remove_parts;
use super::record::Record;
use super::settings;

/// A request for views that has not been made.
pub(super) struct Job {
    pub(super) client: Client,
    offer: OfferStatus,
    pub(super) cameras: Arc<[PinholeCamera]>,
    pub(super) request: SessionRequest,
}

impl Job {
    /// Places the views as the coordinator's offer says.
    ///
    /// # Errors
    /// Arguments cannot be used, no coordinator answers, or the folder cannot be written.
    pub(super) async fn place(args: &ViewArgs) -> anyhow::Result<Self> {
        let client = args.coordinator.connect().await?;
        let status = client.wait_for_nodes(1, Duration::from_secs(30)).await?;
        let offer = offered(status.offers, args.scene.as_deref())?;
        let cameras = args.viewpoints.cameras(&offer, args.size)?;
        std::fs::create_dir_all(&args.out).with_context(|| format!("cannot write to {}", args.out.display()))?;
        let request = session_request(args, &offer, &cameras)?;
        Ok(Self { client, offer, cameras: cameras.into(), request })
    }

    /// Opens the session.
    ///
    /// # Errors
    /// The coordinator's.
    pub(super) async fn open(&self) -> anyhow::Result<Session> {
        let session = open(&self.client, self.request.clone()).await?;
        let plan = session.plan();
        print_line!("plan {}: {}", plan.assignment.plan_epoch, plan.reason);
        Ok(session)
    }

    /// Waits until the promise of a session with a budget is settled, or for the longest time.
    pub(super) async fn wait_for_promise(&self, session: &Session, longest: Duration) -> anyhow::Result<()> {
        if self.request.budget.budget.is_none() {
            return Ok(());
        }
        let progress = ProgressBar::new_spinner();
        progress.enable_steady_tick(Duration::from_millis(200));
        let settled = async {
            let open = [PromiseState::Measuring, PromiseState::Broken];
            let mut promise = session.promise();
            while promise.as_ref().is_none_or(|promise| open.contains(&promise.state)) {
                promise.iter().for_each(|promise| progress.set_message(promise.reason.clone()));
                promise = Some(session.another_promise(promise.as_ref()).await);
            }
        };
        let _ = tokio::time::timeout(longest, settled).await;
        progress.finish_and_clear();
        session.promise().into_iter().for_each(|promise| print_line!("{promise}"));
        Ok(())
    }

    /// Shows all views at one exposure, once it is known: those of later sessions, too.
    pub(super) fn expose(&mut self, record: &Record) {
        if let Some(exposure) = record.exposure {
            self.request.auto_exposure = false;
            self.request.planes.tone.exposure = exposure;
        }
    }

    /// The record of the pictures, with those that an earlier command has left.
    ///
    /// # Errors
    /// There are too many views, or the earlier command's settings were others.
    pub(super) fn record(&self, args: &ViewArgs) -> anyhow::Result<Record> {
        let settings = settings::of(&self.request, &self.offer);
        let views = (self.cameras.clone(), args.frames);
        let mut record = Record::new(&args.out, self.offer.source_space, settings, views, self.request.planes)?;
        if args.resume {
            record.resume()?;
        }
        remove_parts(&args.out);
        Ok(record)
    }
}

/// The offer of a scene by name or hash; the first where none is named.
fn offered(offers: Vec<OfferStatus>, scene: Option<&str>) -> anyhow::Result<OfferStatus> {
    let names: Vec<String> = offers.iter().map(|offer| offer.name.clone()).collect();
    let mut offers = offers.into_iter();
    let named =
        offers.find(|offer| scene.is_none_or(|scene| scene == offer.name || scene == offer.scene.hash.as_str()));
    let reason = format!("--scene {}: on offer are {}", scene.unwrap_or("?"), names.join(", "));
    Ok(named.ok_or(BadInput(reason))?)
}

fn session_request(args: &ViewArgs, offer: &OfferStatus, cameras: &[PinholeCamera]) -> anyhow::Result<SessionRequest> {
    let views = if args.live { &cameras[..1] } else { cameras };
    let OfferSettings { method, sampling, lighting } = offer.settings.clone();
    let settings = OfferSettings {
        method: args.method().map(|method| method.to_string()).or(method),
        sampling,
        lighting: args.lighting.map(|lighting| lighting.to_string()).or(lighting),
    };
    let budget = args.budget.map(|budget| budget.to_string());
    let budget = BudgetRequest { budget, names_method: args.method().is_some() };
    let request = request(settings, Terms { policy: args.policy, budget }, views)?;
    let request = if args.live { at_rate(request, args.rate) } else { request };
    let request = SessionRequest {
        scene: Some(offer.name.clone()),
        codec: args.codec.to_string(),
        planes: args.planes(),
        timeline: Timeline { start_s: 0.0, step_s: args.frame_step, set_count: args.frames },
        viewpoints: if args.cells || args.viewpoints.around.is_some() { viewpoints(cameras) } else { Vec::new() },
        ..request
    };
    // Metrics are of light as it is, unless the arguments say otherwise.
    Ok(if args.compare { args.tone.for_metrics(request) } else { args.tone.for_people(request) })
}
