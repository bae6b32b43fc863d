//! The scene of these tests, sampled finely enough for a page.

use cluster::SessionRequest;
use cluster_tests::gateway_bench::{GatewayBench, session_request};
use glam::UVec2;

/// Columns and rows of a sample image.
pub const SAMPLE_PX: UVec2 = UVec2::new(256, 192);

/// The session of pages, as slow as the scalar device.
pub fn slow_request() -> SessionRequest {
    SessionRequest { sample_size_px: Some(SAMPLE_PX), frames_per_s: Some(2.0), ..session_request() }
}

/// A gateway, and the address of its page.
pub async fn gateway() -> (GatewayBench, String) {
    gateway_of(slow_request()).await
}

/// A gateway for sessions of another kind, and the address of its page.
pub async fn gateway_of(request: SessionRequest) -> (GatewayBench, String) {
    let bench = GatewayBench::start_with(request, |config| config).await;
    let url = format!("http://{}/", bench.authority());
    (bench, url)
}
