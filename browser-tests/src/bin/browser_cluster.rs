//! A coordinator or a node as a process of its own: a test knows the programs of its own package only.

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    cluster_tests::scalar_process::run().await
}
