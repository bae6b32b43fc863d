//! A live stream, by its client or message by message.

use std::time::Duration;

use client::{LiveFrame, LiveView, Session};
use cluster::{LiveRequest, PolicyChoice, RenderViews, RequestedView, SessionRequest, Timeline};
use cluster_tests::cluster::{camera, request};
use codec::{FrameCodec, FramePart};
use depth_image::{PinholeCamera, ViewPlanes};
use glam::UVec2;
use tokio::sync::mpsc;
use tokio::time::timeout;
use tokio_stream::StreamExt as _;
use tokio_stream::wrappers::ReceiverStream;
use tonic::Status;
use tonic::transport::Endpoint;
use wire::rpc::{CompositorClient, Messages, connect};

pub const STILL: Timeline = Timeline { start_s: 0.0, step_s: 0.0, set_count: 1 };
/// Greatest time until frames arrive after a fault.
pub const HEALED: Duration = Duration::from_secs(5);
pub const SIZE_PX: UVec2 = UVec2::new(48, 36);

pub fn pipeline(timeline: Timeline) -> SessionRequest {
    request(PolicyChoice::Pipeline, timeline)
}

/// The next frame shows this pose, as its header states; its stages sum to the time at the compositor.
pub async fn seen(live: &mut LiveView, x_m: f32, set_index: u32) -> LiveFrame {
    let number = live.set_pose(camera(x_m, SIZE_PX), set_index).unwrap();
    loop {
        let received = timeout(HEALED, live.next()).await.expect("a frame in time").unwrap();
        let header = &received.frame.header;
        assert_eq!(header.camera, received.frame.request.camera);
        let t = header.stage_times;
        let stages = t.set_wait_s + t.credit_wait_s + t.queue_s + t.batch_s + t.encode_s + t.send_wait_s;
        assert!((stages - t.compositor_s).abs() < 1e-3, "{t:?}");
        assert!(t.compositor_s <= received.received.duration_since(received.sent).as_secs_f64() + 1e-3, "{t:?}");
        if received.frame.request.frame == number {
            assert_eq!(header.camera, camera(x_m, SIZE_PX));
            assert_eq!(header.sample_set_id.index, u64::from(set_index));
            return received;
        }
        assert!(received.frame.request.frame < number);
    }
}

/// One live stream, message by message.
pub struct Raw {
    pub send: mpsc::Sender<RenderViews>,
    pub parts: Messages<FramePart>,
    pub template: RenderViews,
}

impl Raw {
    pub async fn open(address: &str, plan_epoch: u64) -> Result<Self, Status> {
        Self::open_on(&CompositorClient::new(connect(address).await?), plan_epoch).await
    }

    pub async fn open_on(client: &CompositorClient, plan_epoch: u64) -> Result<Self, Status> {
        let (send, requests) = mpsc::channel(256);
        let parts = client.render_views(ReceiverStream::new(requests)).await?;
        let template = RenderViews {
            plan_epoch,
            workload_number: 1,
            set_index: 0,
            method: "splat".to_owned(),
            codec: FrameCodec::Lz4,
            planes: ViewPlanes::default(),
            views: Vec::new(),
            live: Some(LiveRequest { client_id: 1, ..LiveRequest::default() }),
        };
        Ok(Self { send, parts, template })
    }

    pub async fn say(&self, frame: Option<u64>, acknowledged_frame: u64) {
        self.say_at(frame.map(|frame| (frame, camera(frame as f32 * 1e-3, SIZE_PX))), acknowledged_frame).await;
    }

    pub async fn say_at(&self, pose: Option<(u64, PinholeCamera)>, acknowledged_frame: u64) {
        let views = pose.map(|(frame, camera)| RequestedView { frame, camera });
        let live = self.template.live.map(|live| LiveRequest { acknowledged_frame, ..live });
        let request = RenderViews { views: views.into_iter().collect(), live, ..self.template.clone() };
        let _ = self.send.send(request).await;
    }

    /// The next frame's number; `None` where none arrives soon.
    pub async fn frame(&mut self) -> Option<u64> {
        let part = timeout(Duration::from_millis(500), self.parts.next()).await.ok()?;
        Some(part.unwrap().unwrap().frame)
    }

    pub async fn refused(&mut self) -> Status {
        loop {
            if let Err(status) = timeout(HEALED, self.parts.next()).await.expect("an end").expect("a reason") {
                return status;
            }
        }
    }
}

/// A client whose transport buffers little.
pub async fn narrow(address: &str) -> CompositorClient {
    let endpoint = Endpoint::from_shared(address.to_owned()).unwrap();
    let endpoint = endpoint.initial_stream_window_size(65_535).initial_connection_window_size(65_535);
    CompositorClient::new(endpoint.connect().await.unwrap())
}

pub fn compositor_of(session: &Session) -> (String, u64) {
    let assignment = session.plan().assignment;
    (assignment.compositors[0].address.clone(), assignment.plan_epoch)
}

/// Requests the greatest number of views, of a slow size, and reads none.
pub fn greedy(session: &Session, side_px: u32, count: u64) -> RenderViews {
    let view = |frame| RequestedView { frame, camera: camera(frame as f32 * 1e-4, UVec2::splat(side_px)) };
    RenderViews {
        plan_epoch: session.plan().assignment.plan_epoch,
        workload_number: session.plan().assignment.workload_number,
        set_index: 0,
        method: "splat".to_owned(),
        codec: FrameCodec::Lz4,
        planes: ViewPlanes::ALL,
        views: (0..count).map(view).collect(),
        live: None,
    }
}
