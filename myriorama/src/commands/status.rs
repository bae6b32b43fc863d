//! `myriorama status`: nodes, plan, and the reason of the plan.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context as _;
use app_core::exit::Outcome;
use app_core::process::runtime;
use clap::Args;
use client::Client;

use crate::terminal_picture;

/// Prints the nodes of a cluster with their roles and costs, the plan and its reason.
#[derive(Debug, Args)]
pub struct StatusArgs {
    /// The address of the coordinator
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:7420", env = "MYRIORAMA_COORDINATOR")]
    coordinator: String,
    /// Repeats every S seconds until ctrl-c
    #[arg(long, value_name = "S", num_args = 0..=1, default_missing_value = "1")]
    watch: Option<f64>,
    /// Writes the text as a picture as well (SVG)
    #[arg(long, value_name = "FILE", conflicts_with = "watch")]
    picture: Option<PathBuf>,
}

/// Asks and prints.
///
/// # Errors
/// The coordinator does not answer.
pub fn run(args: &StatusArgs) -> anyhow::Result<Outcome> {
    runtime()?.block_on(show(args))
}

async fn show(args: &StatusArgs) -> anyhow::Result<Outcome> {
    let client =
        Client::connect(&args.coordinator).await.with_context(|| format!("no coordinator at {}", args.coordinator))?;
    loop {
        let text = crate::status_text::text(&client.status().await?)?;
        let Some(seconds) = args.watch else {
            if let Some(file) = &args.picture {
                let written = std::fs::write(file, terminal_picture::svg(&text));
                written.with_context(|| format!("cannot write {}", file.display()))?;
            }
            println!("{text}");
            return Ok(Outcome::Done);
        };
        // The terminal is cleared, so that the table stays in place.
        println!("\x1b[2J\x1b[H{text}");
        tokio::time::sleep(Duration::from_secs_f64(seconds.clamp(0.1, 3600.0))).await;
    }
}
