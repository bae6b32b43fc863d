//! Tests of the proxy, on which other tests rely.

use std::io::ErrorKind;

use tokio::time::timeout;

use super::*;

/// Sends back all bytes.
async fn echo() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = format!("http://{}", listener.local_addr().unwrap());
    tokio::spawn(async move {
        while let Ok((mut stream, _)) = listener.accept().await {
            tokio::spawn(async move {
                let (mut from, mut to) = stream.split();
                let _ = tokio::io::copy(&mut from, &mut to).await;
            });
        }
    });
    address
}

async fn connected(proxy: &Proxy) -> TcpStream {
    TcpStream::connect(proxy.address.trim_start_matches("http://")).await.unwrap()
}

/// The bytes that come back within a second, and the time that takes.
async fn echoed(stream: &mut TcpStream, count: usize) -> io::Result<(Vec<u8>, Duration)> {
    let start = Instant::now();
    let mut bytes = vec![7; count];
    stream.write_all(&bytes).await?;
    timeout(Duration::from_secs(1), stream.read_exact(&mut bytes)).await.map_err(|_| ErrorKind::TimedOut)??;
    Ok((bytes, start.elapsed()))
}

#[tokio::test]
async fn bytes_are_delayed_throttled_and_corrupted_as_ordered() {
    let proxy = Proxy::to(&echo().await, 1);
    let mut stream = connected(&proxy).await;
    assert_eq!(echoed(&mut stream, 5000).await.unwrap().0, vec![7; 5000]);
    let delay = Duration::from_millis(40);
    let jitter = Duration::from_millis(10);
    proxy.set(Way::Pass, Way::Late { delay, jitter, one_in: 0 });
    assert!(echoed(&mut stream, 100).await.unwrap().1 >= delay);
    proxy.set(Way::Slow { bytes_per_s: 50_000.0 }, Way::Pass);
    assert!(echoed(&mut stream, 10_000).await.unwrap().1 >= Duration::from_millis(190));
    proxy.set(Way::Link { bytes_per_s: 50_000.0, delay }, Way::Pass);
    assert!(echoed(&mut stream, 10_000).await.unwrap().1 >= Duration::from_millis(190) + delay);
    proxy.set(Way::Pass, Way::Spoilt { one_in: 1 });
    let (spoilt, _) = echoed(&mut stream, 100).await.unwrap();
    assert!((1..=8).contains(&spoilt.iter().filter(|&&byte| byte != 7).count()));
}

#[tokio::test]
async fn a_partition_delays_bytes_and_loses_none() {
    let proxy = Proxy::to(&echo().await, 1);
    let mut stream = connected(&proxy).await;
    proxy.partition();
    assert_eq!(echoed(&mut stream, 10).await.unwrap_err().kind(), ErrorKind::TimedOut);
    assert_eq!(echoed(&mut connected(&proxy).await, 10).await.unwrap_err().kind(), ErrorKind::TimedOut);
    proxy.heal();
    let mut late = [0; 10];
    stream.read_exact(&mut late).await.unwrap();
    assert_eq!(late, [7; 10]);
}

#[tokio::test]
async fn connections_are_cut_and_refused_as_ordered() {
    let proxy = Proxy::to(&echo().await, 1);
    let mut stream = connected(&proxy).await;
    echoed(&mut stream, 10).await.unwrap();
    proxy.cut();
    assert_eq!(echoed(&mut stream, 10).await.unwrap_err().kind(), ErrorKind::ConnectionReset);
    echoed(&mut connected(&proxy).await, 10).await.unwrap();
    proxy.refuse();
    assert!(echoed(&mut connected(&proxy).await, 10).await.is_err());
    proxy.heal();
    echoed(&mut connected(&proxy).await, 10).await.unwrap();
}
