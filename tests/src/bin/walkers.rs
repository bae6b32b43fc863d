//! 16 walkers on four nodes of the scalar device, a new view cell every two seconds each. Prints the figures by which
//! `bench sharing` judges them, one a line.

use std::time::Duration;

use cluster_tests::cluster::Cluster;
use cluster_tests::walkers::walk;

const WALKERS: usize = 16;
const NODES: usize = 4;
const LASTING: Duration = Duration::from_secs(30);

#[tokio::main]
async fn main() {
    node::init_logging("error");
    let walked = walk(&Cluster::start(NODES).await, WALKERS, LASTING).await;
    println!("policy: {}", walked.policy);
    println!("plans a second: {:.3}", walked.plans as f64 / walked.seconds);
    println!("wanted fetches ended: {}", walked.wanted_fetches_ended);
    println!("longest gap: {:.3}", walked.longest_gap_s);
    println!("sets loaded: {}", walked.sets_loaded);
}
