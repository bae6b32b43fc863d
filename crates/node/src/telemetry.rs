//! Metrics of a process, and the page at which Prometheus reads them. Base units; labels are few and bounded. Logs go to
//! standard error; `RUST_LOG` filters them, and `MYRIORAMA_LOG_FORMAT=json` makes each a line of JSON.

use std::io::IsTerminal as _;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use axum::{Router, http::header, routing::get};
use parking_lot::{Mutex, MutexGuard};
use prometheus_client::encoding::{EncodeLabelSet, text::encode};
use prometheus_client::metrics::{
    counter::Counter,
    family::Family,
    gauge::Gauge,
    histogram::{Histogram, exponential_buckets},
};
use prometheus_client::registry::{Metric, Registry, Unit};
use tokio::net::TcpListener;
use tokio_util::sync::CancellationToken;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt;
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;

use crate::work_done::WorkDone;

const CONTENT_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";
/// Help texts of metrics.
const WANTED_FETCHES_ENDED: &str = "Sample sets that a live view waited for and that could not be fetched";
const UNCOVERED_VIEWS: &str = "Views that a promise is not for, while it is audited";

/// Starts logging. `RUST_LOG` names levels, such as `info` or `warn,coordinator=debug`; where it is not set, `default_levels`
/// apply. A second call does nothing.
pub fn init_logging(default_levels: &str) {
    let named = std::env::var("RUST_LOG").ok().and_then(|named| {
        let levels = named.parse::<Targets>();
        levels.inspect_err(|error| eprintln!("RUST_LOG={named} is ignored: {error}")).ok()
    });
    let levels = named.or_else(|| default_levels.parse().ok()).unwrap_or_default();
    let lines = fmt::layer().with_writer(std::io::stderr).with_ansi(std::io::stderr().is_terminal());
    let is_json = std::env::var("MYRIORAMA_LOG_FORMAT").is_ok_and(|format| format == "json");
    let logging = tracing_subscriber::registry().with(levels);
    let started = if is_json { logging.with(lines.json()).try_init() } else { logging.with(lines).try_init() };
    if started.is_err() {
        tracing::debug!("logging was already started");
    }
}

/// A process's metrics, by name.
#[derive(Debug, Clone)]
pub struct Telemetry(Arc<Mutex<Registry>>);

impl Default for Telemetry {
    fn default() -> Self {
        Self(Arc::new(Mutex::new(Registry::with_prefix("myriorama"))))
    }
}

impl Telemetry {
    /// The registry, to register metrics in.
    pub fn registry(&self) -> MutexGuard<'_, Registry> {
        self.0.lock()
    }

    /// The page, in the OpenMetrics text format.
    #[must_use]
    pub fn page(&self) -> String {
        let mut page = String::new();
        // Writing to a string does not fail.
        let _ = encode(&mut page, &self.registry());
        page
    }

    /// Serves the page at `/metrics` until `shutdown`.
    ///
    /// # Errors
    /// The listener's.
    pub async fn serve(self, listener: TcpListener, shutdown: CancellationToken) -> std::io::Result<()> {
        let page = get(move || async move { ([(header::CONTENT_TYPE, CONTENT_TYPE)], self.page()) });
        let router = Router::new().route("/metrics", page);
        axum::serve(listener, router).with_graceful_shutdown(shutdown.cancelled_owned()).await
    }
}

/// Why a view was dropped, or is not covered by a promise.
#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub struct Reason {
    /// One of a few texts.
    pub reason: &'static str,
}

/// The metrics of a node; their help texts are in [`NodeMetrics::new`].
#[derive(Debug, Clone)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct NodeMetrics {
    pub images_sampled: Counter,
    pub image_s: Histogram,
    pub sets_loaded: Counter,
    pub set_s: Histogram,
    pub wanted_fetches_ended: Counter,
    pub views: Counter,
    pub view_s: Histogram,
    pub queue_s: Histogram,
    pub frame_bytes: Counter,
    pub dropped: Family<Reason, Counter>,
    pub audited_views: Counter,
    pub failed_audits: Counter,
    pub uncovered_views: Family<Reason, Counter>,
    pub audit_s: Counter<f64, AtomicU64>,
    pub streams: Gauge,
    pub plan_epoch: Gauge,
    /// The work to report to the coordinator.
    pub done: WorkDone,
}

fn registered<M: Metric + Clone>(registry: &mut Registry, name: &str, help: &str, metric: M) -> M {
    registry.register(name, help, metric.clone());
    metric
}

fn in_unit<M: Metric + Clone>(registry: &mut Registry, name: &str, help: &str, unit: Unit, metric: M) -> M {
    registry.register_with_unit(name, help, unit, metric.clone());
    metric
}

/// A histogram of times.
fn seconds() -> Histogram {
    Histogram::new(exponential_buckets(0.0005, 2.0, 16))
}

impl NodeMetrics {
    /// Registers all metrics, at zero.
    #[must_use]
    pub fn new(telemetry: &Telemetry) -> Self {
        let counter = Counter::default;
        let gauge = Gauge::default;
        let to = &mut *telemetry.registry();
        Self {
            images_sampled: registered(to, "images_sampled", "Images sampled and encoded", counter()),
            image_s: in_unit(to, "image", "Sampling of one image", Unit::Seconds, seconds()),
            sets_loaded: registered(to, "sets_loaded", "Sample sets fetched and uploaded", counter()),
            wanted_fetches_ended: registered(to, "wanted_fetches_ended", WANTED_FETCHES_ENDED, counter()),
            set_s: in_unit(to, "set_load", "Loading of one sample set", Unit::Seconds, seconds()),
            views: registered(to, "views", "Views made", counter()),
            view_s: in_unit(to, "view", "The device's time for one view", Unit::Seconds, seconds()),
            queue_s: in_unit(to, "queue", "A view's wait for the device", Unit::Seconds, seconds()),
            frame_bytes: in_unit(to, "frames", "Encoded frames", Unit::Bytes, counter()),
            dropped: registered(to, "dropped_views", "Views not made or not sent", Family::default()),
            audited_views: registered(to, "audited_views", "Views drawn directly as well, and compared", counter()),
            failed_audits: registered(to, "failed_audits", "Views that could not be compared", counter()),
            uncovered_views: registered(to, "uncovered_views", UNCOVERED_VIEWS, Family::default()),
            audit_s: in_unit(to, "audit", "Drawing and comparing for audits", Unit::Seconds, Counter::default()),
            streams: registered(to, "streams", "Clients' streams that are open", gauge()),
            plan_epoch: registered(to, "plan_epoch", "The newest plan in force", gauge()),
            done: WorkDone::default(),
        }
    }

    /// Counts a view that a promise is not for.
    pub fn uncover_view(&self, reason: &'static str) {
        self.uncovered_views.get_or_create(&Reason { reason }).inc();
    }

    /// Counts a view that was not made or not sent.
    pub fn drop_view(&self, reason: &'static str) {
        self.dropped.get_or_create(&Reason { reason }).inc();
        self.done.dropped();
    }
}

impl Default for NodeMetrics {
    fn default() -> Self {
        Self::new(&Telemetry::default())
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};

    use super::*;

    #[tokio::test]
    async fn the_page_has_every_metric_that_was_counted() {
        let telemetry = Telemetry::default();
        let metrics = NodeMetrics::new(&telemetry);
        metrics.images_sampled.inc_by(3);
        metrics.view_s.observe(0.004);
        metrics.drop_view("client gone");
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let shutdown = CancellationToken::new();
        let serving = tokio::spawn(telemetry.serve(listener, shutdown.clone()));
        let mut socket = tokio::net::TcpStream::connect(address).await.unwrap();
        socket.write_all(b"GET /metrics HTTP/1.1\r\nhost: x\r\nconnection: close\r\n\r\n").await.unwrap();
        let mut page = String::new();
        socket.read_to_string(&mut page).await.unwrap();
        for line in [
            "myriorama_images_sampled_total 3",
            "myriorama_view_seconds_count 1",
            "myriorama_dropped_views_total{reason=\"client gone\"} 1",
            "# EOF",
        ] {
            assert!(page.contains(line), "{line} in {page}");
        }
        shutdown.cancel();
        serving.await.unwrap().unwrap();
    }
}
