//! Metrics of a process, and the page at which Prometheus reads them. Base units; labels are few and bounded. Logs go to
//! standard error; `RUST_LOG` filters them, and `MYRIORAMA_LOG_FORMAT=json` makes each a line of JSON.

use std::io::IsTerminal as _;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use axum::{Router, http::header, routing::get};
use parking_lot::Mutex;
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
    /// Registers a metric, in a unit where there is one.
    pub fn registered<M: Metric + Clone>(&self, name: &str, help: &str, unit: Option<Unit>, metric: M) -> M {
        let mut registry = self.0.lock();
        match unit {
            Some(unit) => registry.register_with_unit(name, help, unit, metric.clone()),
            None => registry.register(name, help, metric.clone()),
        }
        metric
    }

    /// The page, in the OpenMetrics text format.
    #[must_use]
    pub fn page(&self) -> String {
        let mut page = String::new();
        // Writing to a string does not fail.
        let _ = encode(&mut page, &self.0.lock());
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

/// Metrics of a process and their registration, from one list of `field: type = zero, "name" in Unit, "help";`, where `= zero`
/// and `in Unit` may be left out. One more field, which is not registered, follows `beside`.
#[macro_export]
macro_rules! metrics {
    (@zero) => { Default::default() };
    (@zero $zero:expr) => { $zero };
    (@unit) => { None };
    (@unit $unit:ident) => { Some(Unit::$unit) };
    (
        $(#[$about:meta])*
        pub struct $metrics:ident {
            $($visibility:vis $field:ident: $metric:ty $(= $zero:expr)?, $name:literal $(in $unit:ident)?, $help:literal;)+
        } beside {
            $(#[$about_other:meta])*
            $visibility_other:vis $other:ident: $type:ty
        }
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone)]
        #[allow(missing_docs, reason = "self-naming fields")]
        pub struct $metrics {
            $($visibility $field: $metric,)+
            $(#[$about_other])*
            $visibility_other $other: $type,
        }

        impl $metrics {
            /// Registers all metrics, at zero.
            #[must_use]
            pub fn new(telemetry: &$crate::Telemetry) -> Self {
                Self {
                    $($field: telemetry.registered(
                        $name,
                        $help,
                        $crate::metrics!(@unit $($unit)?),
                        $crate::metrics!(@zero $($zero)?),
                    ),)+
                    $other: Default::default(),
                }
            }
        }

        impl Default for $metrics {
            fn default() -> Self {
                Self::new(&$crate::Telemetry::default())
            }
        }
    };
}

metrics! {
    /// The metrics of a node.
    pub struct NodeMetrics {
        pub images_sampled: Counter, "images_sampled", "Images sampled and encoded";
        pub image_s: Histogram = seconds(), "image" in Seconds, "Sampling of one image";
        pub sets_loaded: Counter, "sets_loaded", "Sample sets fetched and uploaded";
        pub wanted_fetches_ended: Counter, "wanted_fetches_ended",
            "Sample sets that a live view waited for and that could not be fetched";
        pub set_s: Histogram = seconds(), "set_load" in Seconds, "Loading of one sample set";
        pub views: Counter, "views", "Views made";
        pub view_s: Histogram = seconds(), "view" in Seconds, "The device's time for one view";
        pub queue_s: Histogram = seconds(), "queue" in Seconds, "A view's wait for the device";
        pub frame_bytes: Counter, "frames" in Bytes, "Encoded frames";
        pub dropped: Family<Reason, Counter>, "dropped_views", "Views not made or not sent";
        pub audited_views: Counter, "audited_views", "Views drawn directly as well, and compared";
        pub failed_audits: Counter, "failed_audits", "Views that could not be compared";
        pub uncovered_views: Family<Reason, Counter>, "uncovered_views",
            "Views that a promise is not for, while it is audited";
        pub audit_s: Counter<f64, AtomicU64>, "audit" in Seconds, "Drawing and comparing for audits";
        pub streams: Gauge, "streams", "Clients' streams that are open";
        pub plan_epoch: Gauge, "plan_epoch", "The newest plan in force";
    } beside {
        /// The work to report to the coordinator.
        pub done: WorkDone
    }
}

/// A histogram of times.
fn seconds() -> Histogram {
    Histogram::new(exponential_buckets(0.0005, 2.0, 16))
}

impl NodeMetrics {
    /// Counts a view that was not made or not sent.
    pub fn drop_view(&self, reason: &'static str) {
        self.dropped.get_or_create(&Reason { reason }).inc();
        self.done.dropped();
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
