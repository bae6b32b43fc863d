//! A cluster, a gateway and a browser, each a process.

use std::time::Duration;

use cluster::PolicyChoice;
use gpu::DevicePreference;

use super::page::Page;
use crate::process::Process;
use crate::processes::{Processes, Setting, Share};

const NODES: usize = 2;
/// The longest wait for the first picture: shaders are compiled.
const FIRST_PICTURE: Duration = Duration::from_secs(120);

/// What all parts are measured on.
#[derive(Debug, Clone)]
pub(super) struct Ground {
    pub(super) scene: String,
    pub(super) device: DevicePreference,
    /// Repeats of a measurement.
    pub(super) repeats: usize,
    /// Seconds of the measurement of memory.
    pub(super) memory_s: f64,
}

/// Processes that end when they are dropped.
pub(super) struct Stand {
    pub(super) processes: Processes,
    pub(super) gateway: Process,
    /// The page's address.
    pub(super) url: String,
    policy: PolicyChoice,
}

impl Stand {
    /// Starts a coordinator, two nodes and a gateway.
    ///
    /// # Errors
    /// A process does not start.
    pub(super) async fn start(ground: &Ground, policy: PolicyChoice) -> anyhow::Result<Self> {
        let coordinator = ["--scene", &ground.scene].map(str::to_owned).to_vec();
        let setting = Setting { coordinator, device: ground.device, nodes: NODES, share: Share::Whole };
        let processes = Processes::start(&setting).await?;
        let (gateway, url) = gateway(&processes.address, policy, "127.0.0.1:0")?;
        Ok(Self { processes, gateway, url, policy })
    }

    /// Kills the gateway as `kill -9` does, waits, and starts another one on its port.
    ///
    /// # Errors
    /// It does not start.
    pub(super) async fn restart_gateway(&mut self, away: Duration) -> anyhow::Result<()> {
        self.gateway.kill();
        tokio::time::sleep(away).await;
        let listen = authority(&self.url).to_owned();
        (self.gateway, self.url) = gateway(&self.processes.address, self.policy, &listen)?;
        Ok(())
    }

    /// A browser with a view of this size and the page in it, which shows a still.
    ///
    /// # Errors
    /// There is no browser, or no picture.
    pub(super) async fn page(&self, size_px: [u32; 2]) -> anyhow::Result<Page> {
        let page = Page::start(size_px).await?;
        page.browser.open(&self.url).await?;
        page.wait_for_finished(FIRST_PICTURE).await?;
        Ok(page)
    }
}

/// The host and the port of an address.
pub(super) fn authority(url: &str) -> &str {
    url.trim_start_matches("http://").trim_end_matches('/')
}

/// A gateway, and the address of its page.
fn gateway(coordinator: &str, policy: PolicyChoice, listen: &str) -> anyhow::Result<(Process, String)> {
    let policy = policy.to_string();
    let mut gateway = Process::gateway(&["--coordinator", coordinator, "--listen", listen, "--policy", &policy])?;
    let url = gateway.address()?;
    Ok((gateway, url))
}
