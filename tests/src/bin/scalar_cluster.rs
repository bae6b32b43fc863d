//! A coordinator or a node as a process of its own.

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    cluster_tests::scalar_process::run().await
}
