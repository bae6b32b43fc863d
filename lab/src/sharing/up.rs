//! The cluster in one process, beside which most figures are taken.

use app_core::exit::BadInput;
use client::Client;
use cluster::OfferStatus;

use crate::process::Process;

/// A running `myriorama up`, which ends when it is dropped.
pub(super) struct Up {
    /// The address of the coordinator.
    pub(super) coordinator: String,
    /// The scenes on offer, in the order of the arguments.
    pub(super) offers: Vec<OfferStatus>,
    /// The name of the device.
    pub(super) device: String,
    _process: Process,
}

impl Up {
    /// Starts a cluster with these arguments of `myriorama up`.
    ///
    /// # Errors
    /// The cluster does not start.
    pub(super) async fn start(arguments: &[String]) -> anyhow::Result<Self> {
        let mut process = Process::up(arguments)?;
        let coordinator = process.address()?;
        let status = Client::connect(&coordinator).await?.status().await?;
        let device = status.nodes.first().map_or_else(String::new, |node| node.device_name.clone());
        Ok(Self { coordinator, offers: status.offers, device, _process: process })
    }

    /// The scene of the viewer and the other one.
    ///
    /// # Errors
    /// Fewer are on offer.
    pub(super) fn two_offers(&self) -> anyhow::Result<[&OfferStatus; 2]> {
        match &self.offers[..] {
            [one, other, ..] => Ok([one, other]),
            _ => Err(BadInput("two scenes are needed".to_owned()).into()),
        }
    }
}

/// The policies in force, one for each kind of plan.
///
/// # Errors
/// The coordinator does not answer.
pub(super) async fn policies(coordinator: &str) -> anyhow::Result<String> {
    let workloads = Client::connect(coordinator).await?.status().await?.workloads;
    let plans = workloads.into_iter().filter_map(|workload| workload.plan);
    let mut names: Vec<String> = plans.map(|plan| plan.assignment.policy.to_string()).collect();
    names.sort();
    names.dedup();
    Ok(names.join(" and "))
}
