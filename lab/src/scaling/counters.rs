//! Counters of nodes, read from their Prometheus pages.

use anyhow::Context as _;

use crate::process::http_page;

/// Counters of nodes, summed since they started.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Counters {
    /// Sampled images, or tiles of them.
    pub images: f64,
    /// Seconds of sampling and encoding, as if of whole images.
    pub image_s: f64,
    pub sets: f64,
    pub views: f64,
    /// Seconds of the device for views.
    pub view_s: f64,
}

impl Counters {
    /// The sum of two counters, the second with a factor.
    fn plus_times(&self, other: &Self, factor: f64) -> Self {
        Self {
            images: self.images + factor * other.images,
            image_s: self.image_s + factor * other.image_s,
            sets: self.sets + factor * other.sets,
            views: self.views + factor * other.views,
            view_s: self.view_s + factor * other.view_s,
        }
    }

    /// The sum of both.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        self.plus_times(other, 1.0)
    }

    /// The difference of two readings.
    #[must_use]
    pub fn since(&self, before: &Self) -> Self {
        self.plus_times(before, -1.0)
    }

    fn of_page(page: &str) -> anyhow::Result<Self> {
        let value = |name: &str| -> anyhow::Result<f64> {
            let line = page.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
            line.and_then(|text| text.trim().parse().ok()).with_context(|| format!("no {name} in a node's metrics"))
        };
        Ok(Self {
            images: value("myriorama_images_sampled_total")?,
            image_s: value("myriorama_image_seconds_sum")?,
            sets: value("myriorama_sets_loaded_total")?,
            views: value("myriorama_views_total")?,
            view_s: value("myriorama_view_seconds_sum")?,
        })
    }
}

/// Reads the counters of a node from `http://HOST:PORT/metrics`.
///
/// # Errors
/// Nobody answers, or the page lacks a counter.
pub async fn read(url: &str) -> anyhow::Result<Counters> {
    let page = http_page(url).await?;
    Counters::of_page(&page)
}

#[cfg(test)]
mod tests {
    use node::{NodeMetrics, Telemetry};

    use super::*;

    #[tokio::test]
    async fn a_nodes_own_page_is_read() {
        let telemetry = Telemetry::default();
        let metrics = NodeMetrics::new(&telemetry);
        metrics.images_sampled.inc_by(3);
        metrics.image_s.observe(0.5);
        metrics.view_s.observe(0.25);
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let url = format!("http://{}/metrics", listener.local_addr().unwrap());
        let shutdown = tokio_util::sync::CancellationToken::new();
        let serving = tokio::spawn(telemetry.serve(listener, shutdown.clone()));
        let before = read(&url).await.unwrap();
        assert_eq!((before.images, before.image_s, before.view_s), (3.0, 0.5, 0.25));
        metrics.images_sampled.inc();
        let after = read(&url).await.unwrap();
        assert_eq!(after.since(&before), Counters { images: 1.0, ..Counters::default() });
        assert!(Counters::of_page("myriorama_views_total 3").is_err());
        shutdown.cancel();
        serving.await.unwrap().unwrap();
    }
}
