//! A gateway in front of a cluster, in one process, and the pictures that its pages must show.

use std::sync::Arc;

use client::ViewRequest;
use cluster::{PolicyChoice, SessionRequest, Timeline};
use depth_image::{Antialias, LightCacheQuality, PinholeCamera, View, ViewPlanes};
use gateway::{GatewayConfig, SharedLightMethods};
use glam::{DVec3, UVec2, Vec3};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::{TcpListener, TcpStream};

use crate::cluster::{Cluster, Server, offer, request};
use crate::scalar_engine::LIGHT_CACHE;

/// A camera as pages state it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PageCamera {
    /// The place of the eye.
    pub eye: [f64; 3],
    /// A point in the middle of the picture.
    pub target: [f64; 3],
    /// The full vertical field of view.
    pub fov_y_deg: f64,
}

impl PageCamera {
    /// The camera of a picture of this size, in the scene of [`offer`].
    #[must_use]
    pub fn of_size(&self, size_px: UVec2) -> PinholeCamera {
        let [eye, target] = [self.eye, self.target].map(|point| DVec3::from_array(point).as_vec3());
        let camera = PinholeCamera::looking_at(eye, target, Vec3::Y, self.fov_y_deg.to_radians() as f32, size_px);
        PinholeCamera { near_m: offer().volume.near_m(), ..camera }
    }
}

/// A cluster, and a gateway that can be killed.
pub struct GatewayBench {
    /// The cluster.
    pub cluster: Cluster,
    /// The gateway.
    pub gateway: Server,
    config: GatewayConfig,
    request: SessionRequest,
}

/// The session of pages: colours alone, as fast as viewers wish.
#[must_use]
pub fn session_request() -> SessionRequest {
    let request = request(PolicyChoice::Pipeline, Timeline::still(0.0));
    SessionRequest { planes: ViewPlanes::default(), views_per_set: 1, frames_per_s: Some(20.0), ..request }
}

impl GatewayBench {
    /// A gateway in front of three nodes, with its configuration changed by `change`.
    pub async fn start(change: impl FnOnce(GatewayConfig) -> GatewayConfig) -> Self {
        Self::start_with(session_request(), change).await
    }

    /// As [`GatewayBench::start`], for sessions of another kind.
    pub async fn start_with(request: SessionRequest, change: impl FnOnce(GatewayConfig) -> GatewayConfig) -> Self {
        let cluster = Cluster::start(3).await;
        let of_scene = request.clone();
        let config = config(&cluster.coordinator.address, of_scene);
        let config = change(config);
        let gateway = serve("127.0.0.1:0", config.clone());
        Self { cluster, gateway, config, request }
    }

    /// The gateway's `host:port`.
    #[must_use]
    pub fn authority(&self) -> &str {
        self.gateway.address.trim_start_matches("http://")
    }

    /// Kills the gateway abruptly.
    pub fn kill_gateway(&mut self) {
        self.gateway.kill();
    }

    /// Starts a gateway at the address of the last one.
    pub fn restart_gateway(&mut self) {
        self.gateway = serve(self.authority(), self.config.clone());
    }

    /// The finished still of a camera as the Rust client receives it: sRGB bytes, row by row.
    ///
    /// # Panics
    /// The cluster does not serve.
    pub async fn reference(&self, camera: &PageCamera, size_px: [u32; 2]) -> Vec<u8> {
        let planes = ViewPlanes { antialias: Antialias::MOST, ..ViewPlanes::default() };
        self.reference_view(camera, size_px, planes).await.srgb8
    }

    /// As [`GatewayBench::reference`], with further planes.
    ///
    /// # Panics
    /// As [`GatewayBench::reference`].
    pub async fn reference_view(&self, camera: &PageCamera, size_px: [u32; 2], planes: ViewPlanes) -> View {
        // It promises nothing, and takes what viewers leave.
        let request = SessionRequest { frames_per_s: None, ..self.request.clone() };
        let session = self.cluster.client.open_session(request, |_| ()).await.expect("a session");
        let camera = camera.of_size(UVec2::from_array(size_px));
        let view = ViewRequest { frame: 1, set_index: 0, camera };
        let frames = session.render_views_with(planes, None, [view]).expect("a view").all().await;
        frames.expect("a frame").remove(0).view
    }

    /// The answer to a request of HTTP: its status line and headers, and its body.
    ///
    /// # Panics
    /// The gateway does not answer.
    pub async fn get(&self, path: &str, headers: &str) -> (String, Vec<u8>) {
        let mut stream = TcpStream::connect(self.authority()).await.expect("a connection");
        let request = format!("GET {path} HTTP/1.1\r\n{headers}Connection: close\r\n\r\n");
        stream.write_all(request.as_bytes()).await.expect("sent");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).await.expect("an answer");
        let end = answer.windows(4).position(|window| window == b"\r\n\r\n").expect("the end of the headers");
        (String::from_utf8_lossy(&answer[..end]).into_owned(), answer[end + 4..].to_vec())
    }
}

/// A gateway of another cluster, for sessions of this kind.
#[must_use]
pub fn gateway_of(coordinator: &str, request: SessionRequest) -> Server {
    serve("127.0.0.1:0", config(coordinator, request))
}

fn config(coordinator: &str, request: SessionRequest) -> GatewayConfig {
    let methods = SharedLightMethods {
        of_quality: |quality| format!("{LIGHT_CACHE}:{quality}"),
        quality_of: |method| LightCacheQuality::named(method.strip_prefix(LIGHT_CACHE)?.strip_prefix(':')?),
    };
    GatewayConfig::new(coordinator, Arc::new(move |_, _| request.clone()), methods)
}

fn serve(address: &str, config: GatewayConfig) -> Server {
    Server::start_at(address, |listener: TcpListener, shutdown| async move {
        gateway::serve(gateway::accept(listener), config, shutdown).await;
        Ok(())
    })
}
