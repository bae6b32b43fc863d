//! A proxy before a node that spoils the chunks of its answers and ends streams of frames early.

use std::sync::Arc;

use cluster::{ApplyPlan, FetchImages, MeasureCosts, Measured, Ready, RenderViews};
use codec::{Chunk, FramePart};
use node::{ServeError, serve};
use parking_lot::Mutex;
use tokio::net::TcpListener;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tokio_stream::{Stream, StreamExt as _};
use tokio_util::sync::{CancellationToken, DropGuard};
use tonic::service::Routes;
use tonic::{Status, async_trait};
use wire::rpc::{
    Compositor, CompositorClient, Messages, Node, NodeClient, Sampler, SamplerClient, compositor_server, connect,
    node_server, sampler_server,
};

/// A change to the chunks of one answer.
pub type Spoil = fn(&mut Vec<Chunk>);

#[derive(Default)]
struct Orders {
    spoil: Option<Spoil>,
    /// Number of answers still to be corrupted.
    times: usize,
    /// Number of streams of frames that still end after their first frame.
    cut: usize,
}

/// A server that ends when it is dropped.
pub struct Mangler {
    /// The address that the node is to advertise.
    pub address: String,
    node: Arc<Mutex<String>>,
    orders: Arc<Mutex<Orders>>,
    _ends: DropGuard,
}

impl Mangler {
    /// Starts a mangler for a node that is named later.
    ///
    /// # Panics
    /// No port is free.
    pub async fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let address = format!("http://{}", listener.local_addr().expect("an address"));
        let node = Arc::<Mutex<String>>::default();
        let orders = Arc::<Mutex<Orders>>::default();
        let front = Front { node: node.clone(), orders: orders.clone() };
        let shutdown = CancellationToken::new();
        tokio::spawn(serve_front(listener, front, shutdown.clone()));
        Self { address, node, orders, _ends: shutdown.drop_guard() }
    }

    /// Sets the node that is asked.
    pub fn stand_before(&self, address: &str) {
        *self.node.lock() = address.to_owned();
    }

    /// Corrupts the next `times` answers.
    pub fn spoil(&self, times: usize, spoil: Spoil) {
        *self.orders.lock() = Orders { spoil: Some(spoil), times, cut: 0 };
    }

    /// Ends the next `streams` of frames after their first frame, as if they were complete.
    pub fn cut(&self, streams: usize) {
        self.orders.lock().cut = streams;
    }

    /// The number of answers still to be corrupted, or cut.
    #[must_use]
    pub fn left(&self) -> usize {
        let orders = self.orders.lock();
        orders.times + orders.cut
    }
}

async fn serve_front(listener: TcpListener, front: Front, shutdown: CancellationToken) -> Result<(), ServeError> {
    let routes = Routes::new(sampler_server(front.clone()))
        .add_service(node_server(front.clone()))
        .add_service(compositor_server(front));
    serve(listener, routes, false, shutdown).await
}

#[derive(Clone)]
struct Front {
    node: Arc<Mutex<String>>,
    orders: Arc<Mutex<Orders>>,
}

impl Front {
    fn node(&self) -> String {
        self.node.lock().clone()
    }

    fn spoilt(&self, chunks: &mut Vec<Chunk>) {
        let mut orders = self.orders.lock();
        if let Some(spoil) = orders.spoil.filter(|_| orders.times > 0) {
            orders.times -= 1;
            spoil(chunks);
        }
    }

    fn cuts(&self) -> bool {
        let mut orders = self.orders.lock();
        let cuts = orders.cut > 0;
        orders.cut -= usize::from(cuts);
        cuts
    }
}

/// The parts up to the second header.
fn first_frame(parts: Messages<FramePart>) -> impl Stream<Item = Result<FramePart, Status>> + Send {
    let mut headers = 0;
    parts.take_while(move |part| {
        headers += usize::from(part.as_ref().is_ok_and(|part| part.header.is_some()));
        headers < 2
    })
}

#[async_trait]
impl Sampler for Front {
    async fn fetch_sample_images(&self, request: FetchImages) -> Result<Messages<Chunk>, Status> {
        let mut coming = SamplerClient::new(connect(&self.node()).await?).fetch_sample_images(request).await?;
        let mut chunks = Vec::new();
        while let Some(chunk) = coming.next().await {
            chunks.push(chunk?);
        }
        self.spoilt(&mut chunks);
        Ok(Box::pin(tokio_stream::iter(chunks).map(Ok)))
    }
}

#[async_trait]
impl Node for Front {
    async fn measure_costs(&self, request: MeasureCosts) -> Result<Measured, Status> {
        NodeClient::new(connect(&self.node()).await?).measure_costs(request).await
    }

    async fn apply_assignment(&self, plan: ApplyPlan) -> Result<Ready, Status> {
        NodeClient::new(connect(&self.node()).await?).apply_assignment(plan).await
    }
}

#[async_trait]
impl Compositor for Front {
    async fn render_views(&self, mut requests: Messages<RenderViews>) -> Result<Messages<FramePart>, Status> {
        let (send, passed) = mpsc::channel(4);
        tokio::spawn(async move {
            while let Some(Ok(request)) = requests.next().await {
                if send.send(request).await.is_err() {
                    break;
                }
            }
        });
        let parts =
            CompositorClient::new(connect(&self.node()).await?).render_views(ReceiverStream::new(passed)).await?;
        Ok(if self.cuts() { Box::pin(first_frame(parts)) } else { parts })
    }
}
