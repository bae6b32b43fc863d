//! The viewer on the coordinator's own port, and the sessions that visitors of any gateway share.

use std::io::Write as _;
use std::sync::Arc;

use app_core::delivery::{at_rate, request};
use clap::Args;
use cluster::{OfferStatus, PolicyChoice, SessionRequest, Timeline};
use depth_image::PinholeCamera;
use gateway::{Connections, GatewayConfig, RequestOf, SharedLightMethods};
use node::Port;
use reconstruction::ReconstructionMethod;
use render::Lighting;
use tokio::net::TcpListener;
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;

use crate::tone::ToneArgs;

/// Pictures a second of a visitor who moves.
const PICTURES_PER_S: f64 = 20.0;
/// Connections of browsers that wait to be served.
const WAITING: usize = 16;

/// The viewer on the port of a coordinator.
#[derive(Debug, Clone, Args)]
pub struct ViewerArgs {
    /// Serves no viewer on the port: only gRPC
    #[arg(long)]
    no_viewer: bool,
    #[command(flatten)]
    names: NameArgs,
    #[command(flatten)]
    tone: ToneArgs,
}

/// The names by which browsers reach a server.
#[derive(Debug, Clone, Args)]
pub struct NameArgs {
    /// A name of this server in links, beside localhost and addresses; may be repeated
    #[arg(long = "host", value_name = "NAME")]
    pub hosts: Vec<String>,
    /// Another page that may use this server, as https://host; may be repeated
    #[arg(long = "allow-origin", value_name = "ORIGIN")]
    pub origins: Vec<String>,
}

impl ViewerArgs {
    /// The port of a coordinator, and the browsers that come to it where there is a viewer.
    pub fn share(&self, listener: TcpListener) -> (Port, Option<Connections>) {
        if self.no_viewer {
            return (listener.into(), None);
        }
        let (send, browsers) = mpsc::channel(WAITING);
        (Port { listener, browsers: Some(send) }, Some(browsers))
    }

    /// Serves these browsers from the coordinator at this address until `shutdown`, and prints the link. Returns the task that
    /// serves them; none without browsers.
    pub fn serve(&self, browsers: Option<Connections>, coordinator: &str, shutdown: CancellationToken) -> JoinSet<()> {
        let mut visits = JoinSet::new();
        let Some(browsers) = browsers else { return visits };
        let request_of = request_of(PolicyChoice::Auto, self.tone);
        let config = GatewayConfig {
            hosts: self.names.hosts.clone(),
            origins: self.names.origins.clone(),
            ..GatewayConfig::new(coordinator, request_of, shared_light_methods())
        };
        visits.spawn(gateway::serve(browsers, config, shutdown));
        // Whoever started this may read no more than the address.
        let _ = writeln!(std::io::stdout(), "Open {coordinator}/");
        visits
    }
}

/// The methods between which the pictures of a visitor change.
pub fn shared_light_methods() -> SharedLightMethods {
    SharedLightMethods {
        of_quality: |quality| ReconstructionMethod::from(quality).to_string(),
        quality_of: |method| method.parse().ok().and_then(|method: ReconstructionMethod| method.light_cache_quality()),
    }
}

/// The session of a scene's visitors: with the scene's own settings, a rate, fallbacks, light in steps, and view cells that
/// follow them.
pub fn request_of(policy: PolicyChoice, tone: ToneArgs) -> RequestOf {
    Arc::new(move |offer: &OfferStatus, typical: PinholeCamera| {
        let request = request(offer.settings.clone(), policy, &[typical]).expect("one view");
        let request = tone.for_people(at_rate(request, PICTURES_PER_S));
        let steps = request.lighting.parse().map_or(1, |lighting: Lighting| lighting.refinement_steps());
        SessionRequest {
            scene: Some(offer.name.clone()),
            viewpoints: vec![typical],
            refinement_steps: steps,
            timeline: Timeline { set_count: steps, ..Timeline::still(0.0) },
            ..request
        }
    })
}
