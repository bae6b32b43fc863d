//! `myriorama health`: the health of a process, for supervisors that restart it.

use std::time::Duration;

use anyhow::{Context as _, bail};
use app_core::exit::Outcome;
use app_core::print_line;
use clap::Args;

const DEADLINE: Duration = Duration::from_secs(4);

/// Prints the health of a process; exit status 3 if it does not serve or does not answer.
#[derive(Debug, Args)]
pub struct HealthArgs {
    /// The address of a coordinator or a node
    #[arg(value_name = "URL")]
    address: String,
}

/// Asks once.
///
/// # Errors
/// The process does not serve, or does not answer within seconds.
pub async fn run(args: &HealthArgs) -> anyhow::Result<Outcome> {
    let answer = async { anyhow::Ok(tokio::time::timeout(DEADLINE, wire::rpc::is_serving(&args.address, "")).await??) };
    if !answer.await.with_context(|| format!("{} does not answer", args.address))? {
        bail!("{} does not serve", args.address);
    }
    print_line!("{} serves", args.address);
    Ok(Outcome::Done)
}
