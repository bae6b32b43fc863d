//! A network that fails: a TCP proxy between two processes, switched while they communicate.

#![cfg_attr(test, allow(clippy::unwrap_used))]

mod random;

use std::io;
use std::net::SocketAddr;
use std::pin::pin;
use std::time::Duration;

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::tcp::{ReadHalf, WriteHalf};
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::sync::{mpsc, watch};
use tokio::task::{JoinHandle, JoinSet};
use tokio::time::{Instant, sleep_until};

pub use random::Random;

/// Greatest size of a piece.
const PIECE_BYTES: usize = 8 << 10;
/// Number of pieces under way, bounded as in routers.
const PIECES_UNDER_WAY: usize = 16;
/// Buffer of each socket, small enough that bytes under way are visible from outside.
const SOCKET_BYTES: u32 = 64 << 10;

/// The behaviour of one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// Bytes arrive.
    Pass,
    /// Bytes wait without an error: a cut cable, or a host without power.
    Stall,
    /// Bytes arrive later, in order; one in `one_in` pieces loses a segment, which is sent again.
    Late {
        /// Least delay.
        delay: Duration,
        /// Greatest additional delay.
        jitter: Duration,
        /// 0 for no loss.
        one_in: u64,
    },
    /// Bytes arrive at a limited rate.
    Slow {
        /// Rate of the direction.
        bytes_per_s: f64,
    },
    /// Bytes arrive later and at a limited rate: a link over a long way.
    Link {
        /// Rate of the direction.
        bytes_per_s: f64,
        /// Time of each byte on its way.
        delay: Duration,
    },
    /// One in `one_in` pieces has a byte changed.
    Spoilt {
        /// 1 for every piece.
        one_in: u64,
    },
}

/// Delay of a lost segment: the least time after which Linux sends it again.
const RETRANSMISSION: Duration = Duration::from_millis(200);

/// Both directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Network {
    /// From the client to the server.
    pub forth: Way,
    /// From the server to the client.
    pub back: Way,
    /// New connections are reset at once.
    pub refuses: bool,
    /// Connections from before the last increase are reset.
    cuts: u64,
}

const GOOD: Network = Network { forth: Way::Pass, back: Way::Pass, refuses: false, cuts: 0 };

/// A proxy that ends when it is dropped.
#[derive(Debug)]
pub struct Proxy {
    /// Its address, as `http://host:port`.
    pub address: String,
    target: watch::Sender<Option<SocketAddr>>,
    network: watch::Sender<Network>,
    listening: JoinHandle<()>,
}

impl Drop for Proxy {
    fn drop(&mut self) {
        self.listening.abort();
    }
}

impl Proxy {
    /// Starts a proxy whose target is set later; earlier bytes wait. `seed` is that of delays and changed bytes.
    ///
    /// # Panics
    /// No port is free.
    #[must_use]
    pub fn start(seed: u64) -> Self {
        let socket = TcpSocket::new_v4().expect("a socket");
        socket.set_recv_buffer_size(SOCKET_BYTES).expect("a socket option");
        socket.bind(([127, 0, 0, 1], 0).into()).expect("a port");
        let listener = socket.listen(1024).expect("a listener");
        let address = format!("http://{}", listener.local_addr().expect("an address"));
        let target = watch::Sender::new(None);
        let network = watch::Sender::new(GOOD);
        let listening = tokio::spawn(listen(listener, target.subscribe(), network.subscribe(), Random::new(seed)));
        Self { address, target, network, listening }
    }

    /// Starts a proxy in front of a server.
    ///
    /// # Panics
    /// As [`Proxy::start`].
    #[must_use]
    pub fn to(address: &str, seed: u64) -> Self {
        let proxy = Self::start(seed);
        proxy.lead_to(address);
        proxy
    }

    /// Sets the target: `http://host:port`.
    ///
    /// # Panics
    /// The address has another form.
    pub fn lead_to(&self, address: &str) {
        let target = address.trim_start_matches("http://").parse().expect("host:port");
        self.target.send_replace(Some(target));
    }

    /// Changes both directions, also of open connections.
    pub fn set(&self, forth: Way, back: Way) {
        self.network.send_modify(|network| (network.forth, network.back) = (forth, back));
    }

    /// Stalls both directions, without an error.
    pub fn partition(&self) {
        self.set(Way::Stall, Way::Stall);
    }

    /// Restores the network.
    pub fn heal(&self) {
        self.network.send_modify(|network| *network = Network { cuts: network.cuts, ..GOOD });
    }

    /// Resets all connections; new ones are possible.
    pub fn cut(&self) {
        self.network.send_modify(|network| network.cuts += 1);
    }

    /// Resets all connections, and later attempts.
    pub fn refuse(&self) {
        self.network.send_modify(|network| (network.refuses, network.cuts) = (true, network.cuts + 1));
    }
}

async fn listen(
    listener: TcpListener,
    target: watch::Receiver<Option<SocketAddr>>,
    network: watch::Receiver<Network>,
    mut random: Random,
) {
    // Dropped with the listener: connections then end too.
    let mut connections = JoinSet::new();
    while let Ok((near, _)) = listener.accept().await {
        let target = target.clone();
        let network = network.clone();
        connections.spawn(connect(near, target, network, [random.bits(), random.bits()]));
        while connections.try_join_next().is_some() {}
    }
}

async fn connect(
    near: TcpStream,
    mut target: watch::Receiver<Option<SocketAddr>>,
    network: watch::Receiver<Network>,
    seeds: [u64; 2],
) {
    let known = target.wait_for(Option::is_some).await.ok().and_then(|target| *target);
    let Some(target) = known else { return };
    let refuses = network.borrow().refuses;
    if refuses {
        let _ = near.set_zero_linger();
        return;
    }
    let Ok(far) = far_of(target).await else { return };
    carry(near, far, network, seeds).await;
}

async fn far_of(target: SocketAddr) -> io::Result<TcpStream> {
    let socket = TcpSocket::new_v4()?;
    socket.set_recv_buffer_size(SOCKET_BYTES)?;
    socket.connect(target).await
}

/// Copies bytes until one side resets the connection, both have ended, or it is cut.
async fn carry(mut near: TcpStream, mut far: TcpStream, network: watch::Receiver<Network>, seeds: [u64; 2]) {
    let cuts = network.borrow().cuts;
    let mut watched = network.clone();
    let _ = (near.set_nodelay(true), far.set_nodelay(true));
    let is_reset = {
        let ((near_in, near_out), (far_in, far_out)) = (near.split(), far.split());
        let [forth, back] = seeds.map(Random::new);
        let forth = pump(near_in, far_out, network.clone(), |network| network.forth, forth);
        let back = pump(far_in, near_out, network, |network| network.back, back);
        tokio::select! {
            ended = async { tokio::try_join!(forth, back) } => ended.is_err(),
            _ = watched.wait_for(|network| network.cuts > cuts) => true,
        }
    };
    if is_reset {
        let _ = (near.set_zero_linger(), far.set_zero_linger());
    }
}

/// A piece, and its time of arrival.
type UnderWay = (Instant, Vec<u8>);

/// Reads while earlier pieces are under way: a late network is not a slow one.
async fn pump(
    from: ReadHalf<'_>,
    to: WriteHalf<'_>,
    network: watch::Receiver<Network>,
    way: fn(&Network) -> Way,
    random: Random,
) -> io::Result<()> {
    let (send, receive) = mpsc::channel(PIECES_UNDER_WAY);
    let taking = pin!(take(from, send, network.clone(), way, random));
    tokio::try_join!(taking, give(to, receive, network, way)).map(|_| ())
}

async fn take(
    mut from: ReadHalf<'_>,
    send: mpsc::Sender<UnderWay>,
    network: watch::Receiver<Network>,
    way: fn(&Network) -> Way,
    mut random: Random,
) -> io::Result<()> {
    let mut piece = vec![0; PIECE_BYTES];
    let mut last = Instant::now();
    loop {
        let count = from.read(&mut piece).await?;
        let mut bytes = piece[..count].to_vec();
        let way = way(&network.borrow());
        last = last.max(Instant::now()) + spent(way, &mut bytes, &mut random);
        let due = last + waited(way, &mut random);
        // An empty piece is the end.
        if send.send((due, bytes)).await.is_err() || count == 0 {
            return Ok(());
        }
    }
}

/// The serial time of a piece; changes a byte where the direction corrupts.
fn spent(way: Way, bytes: &mut [u8], random: &mut Random) -> Duration {
    match way {
        Way::Slow { bytes_per_s } | Way::Link { bytes_per_s, .. } => {
            Duration::from_secs_f64(bytes.len() as f64 / bytes_per_s)
        }
        Way::Spoilt { one_in } if one_in > 0 && !bytes.is_empty() && random.below(one_in) == 0 => {
            let at = random.below(bytes.len() as u64) as usize;
            bytes[at] ^= 1 << random.below(8);
            Duration::ZERO
        }
        _ => Duration::ZERO,
    }
}

/// The additional time of a piece that overlaps with others.
fn waited(way: Way, random: &mut Random) -> Duration {
    let (delay, jitter, one_in) = match way {
        Way::Late { delay, jitter, one_in } => (delay, jitter, one_in),
        Way::Link { delay, .. } => return delay,
        _ => return Duration::ZERO,
    };
    let again = if one_in > 0 && random.below(one_in) == 0 { RETRANSMISSION } else { Duration::ZERO };
    delay + random.up_to(jitter) + again
}

async fn give(
    mut to: WriteHalf<'_>,
    mut receive: mpsc::Receiver<UnderWay>,
    mut network: watch::Receiver<Network>,
    way: fn(&Network) -> Way,
) -> io::Result<()> {
    let mut last = Instant::now();
    while let Some((due, bytes)) = receive.recv().await {
        // A lost segment delays the pieces after it.
        last = last.max(due);
        sleep_until(last).await;
        if network.wait_for(|network| way(network) != Way::Stall).await.is_err() {
            return Ok(());
        }
        if bytes.is_empty() {
            return to.shutdown().await;
        }
        to.write_all(&bytes).await?;
    }
    Ok(())
}

#[cfg(test)]
#[path = "proxy_tests.rs"]
mod tests;
