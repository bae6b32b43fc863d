//! Gateways with TLS and a token.

use std::time::Duration;

use browser::BrowserOptions;
use browser_tests::visit::{Expected, Visit};
use cluster_tests::gateway_bench::GatewayBench;
use gateway::{GatewayConfig, Token, tls_config};
use glam::DVec3;

use crate::scene::slow_request;

const POSE: &str = "#c=1,1.5,2.5;-0.2,0.5,0.1;40";
/// Pages connect again within this time.
const RETRY: Duration = Duration::from_secs(2);

/// A gateway with these settings, and a token.
async fn guarded(change: impl FnOnce(GatewayConfig) -> GatewayConfig) -> (GatewayBench, Token) {
    let token = Token::random().unwrap();
    let with_token = |config| GatewayConfig { token: Some(token.clone()), ..change(config) };
    (GatewayBench::start_with(slow_request(), with_token).await, token)
}

/// The gateway's settings with a certificate of its own.
fn certified(config: GatewayConfig) -> GatewayConfig {
    let folder = tempfile::tempdir().unwrap();
    let [certificate, key] = ["certificate.pem", "key.pem"].map(|name| folder.path().join(name));
    let made = rcgen::generate_simple_self_signed(["127.0.0.1".to_owned()]).unwrap();
    std::fs::write(&certificate, made.cert.pem()).unwrap();
    std::fs::write(&key, made.signing_key.serialize_pem()).unwrap();
    GatewayConfig { tls: Some(tls_config(&certificate, &key).unwrap()), ..config }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_link_with_a_token_opens_its_pose_over_tls() {
    let (bench, token) = guarded(certified).await;
    let link = format!("https://{}/{}{POSE}", bench.authority(), token.query());
    let arguments = vec!["--ignore-certificate-errors".to_owned()];
    let visit = Visit::with(&link, BrowserOptions { arguments, ..BrowserOptions::default() }).await;
    let still = visit.settled().await;
    let canvas = visit.canvas().await;
    assert!(canvas.srgb8 == bench.reference(&still.header.camera.into(), canvas.size_px).await);
    let state = visit.state().await;
    assert!((state.eye() - DVec3::new(1.0, 1.5, 2.5)).length() < 1e-9, "{state:?}");
    visit.until("location.hash.startsWith('#c=1,1.5,2.5;')").await;
    let address: String = visit.browser.value("location.href").await.unwrap();
    assert!(address.starts_with(&format!("https://{}/#", bench.authority())), "{address}");
    let socket: String = visit.browser.value("myriorama.link.socket.url").await.unwrap();
    assert!(socket.starts_with("wss://"), "{socket}");
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_without_the_token_says_so_and_stops_until_its_link_is_opened() {
    let (bench, token) = guarded(|config| config).await;
    let url = format!("http://{}/", bench.authority());
    let visit = Visit::to(&url).await;
    visit.until("!document.getElementById('banner').hidden").await;
    visit.until("document.getElementById('banner').textContent.startsWith('Refused: the token is missing')").await;
    let status: u16 = visit.browser.value("(await fetch('api/v1/view.png')).status").await.unwrap();
    assert_eq!(status, 401);
    visit.browser.run::<()>("window.refused = myriorama.link.socket", Vec::new()).await.unwrap();
    tokio::time::sleep(RETRY).await;
    assert!(visit.browser.value::<bool>("window.refused === myriorama.link.socket").await.unwrap(), "it tries again");
    visit.browser.open(&format!("{url}{}", token.query())).await.unwrap();
    visit.rested().await;
    visit.until("document.getElementById('banner').hidden && !location.search").await;
    visit.end(Expected::LostConnections).await;
}
