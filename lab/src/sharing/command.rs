//! `myriorama bench sharing`: whether clients of one cluster leave each other alone.

use std::path::PathBuf;

use app_core::exit::Outcome;
use app_core::process::runtime;
use clap::Args;
use gpu::DevicePreference;
use render::Lighting;
use scene::SceneSpec;
use study::Report;

use super::beside::{self, Row, offers};
use super::guests::{GUESTS, Guest};
use super::report::{self, Measured};
use super::viewer::path;
use crate::process::Process;
use crate::progress::bar;

/// Measures a live viewer of 320×180 at 10 poses a second beside batches of other clients: other sizes, lightings,
/// codecs, scenes, moments, and views drawn directly. Each batch is measured alone, too.
#[derive(Debug, Args)]
#[command(after_help = "Example: myriorama bench sharing --strict")]
pub struct SharingArgs {
    /// The scene of the viewer
    #[arg(long, value_name = "SPEC", default_value = "tree-terrain-500k")]
    scene: SceneSpec,
    /// The scene of the guest that asks for another one
    #[arg(long, value_name = "SPEC", default_value = "courtyard")]
    other_scene: SceneSpec,
    /// How surfaces are lit
    #[arg(long, value_name = "TERMS", default_value = "soft 4, occlusion 4")]
    lighting: Lighting,
    /// any (a GPU if there is one) or software
    #[arg(long, default_value_t, value_name = "NAME", env = "MYRIORAMA_DEVICE")]
    device: DevicePreference,
    /// Nodes P that share the device
    #[arg(long, default_value_t = 4, value_name = "P", value_parser = clap::value_parser!(u16).range(2..=64))]
    nodes: u16,
    /// One repeat in place of three
    #[arg(long)]
    quick: bool,
    /// Where the report goes
    #[arg(long, default_value = "out/bench-sharing", value_name = "DIR")]
    out: PathBuf,
    /// Exit status 1 when a check falls short
    #[arg(long)]
    strict: bool,
}

impl SharingArgs {
    fn repeats(&self) -> usize {
        if self.quick { 1 } else { 3 }
    }

    /// Arguments of `myriorama up`.
    fn cluster(&self) -> Vec<String> {
        let [scene, other, lighting] =
            [self.scene.to_string(), self.other_scene.to_string(), self.lighting.to_string()];
        let (device, nodes) = (self.device.to_string(), self.nodes.to_string());
        let words =
            ["--scene", &scene, "--scene", &other, "--lighting", &lighting, "--device", &device, "--nodes", &nodes];
        words.map(str::to_owned).to_vec()
    }
}

/// Measures all guests and writes the report.
///
/// # Errors
/// The cluster does not start, or a client fails.
pub fn run(args: &SharingArgs) -> anyhow::Result<Outcome> {
    let (measured, device) = runtime()?.block_on(measure(args))?;
    let mut report = Report::new("Myriorama bench sharing", device);
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    for (name, value) in [
        ("scene", args.scene.to_string()),
        ("other scene", args.other_scene.to_string()),
        ("lighting", args.lighting.to_string()),
        ("policy", "pipeline, forced by every session".to_owned()),
    ] {
        report.parameter(name, value);
    }
    report.parameter("nodes P", u32::from(args.nodes));
    report.parameter("repeats", args.repeats());
    report::add(&measured, &mut report)?;
    report.tables.iter().for_each(|table| println!("{}", table.to_markdown()));
    let ok = report.finish(&args.out)?;
    Ok(Outcome::of(ok || !args.strict))
}

async fn measure(args: &SharingArgs) -> anyhow::Result<(Measured, String)> {
    let progress = bar("sharing", GUESTS.len() + 1);
    let mut up = Process::up(&args.cluster())?;
    let coordinator = up.address()?;
    let status = client::Client::connect(&coordinator).await?.status().await?;
    let device = status.nodes.first().map_or_else(String::new, |node| node.device_name.clone());
    let mut rows: Vec<(&'static Guest, Option<Row>)> = Vec::new();
    for guest in &GUESTS {
        progress.set_message(guest.name);
        // One guest that is refused, or that ends the viewer, hides no other.
        let row = beside::measure(&coordinator, guest, args.repeats()).await;
        if let Err(error) = &row {
            tracing::warn!(guest = guest.name, error = format!("{error:#}"), "not measured");
        }
        rows.push((guest, row.ok()));
        progress.inc(1);
    }
    progress.set_message("a view of a new size");
    let new_size = new_size(&coordinator).await?;
    progress.finish_and_clear();
    Ok((Measured { rows, new_size_s: new_size }, device))
}

/// Seconds until the first view of a known size, and of a new one, on a warm workload.
async fn new_size(coordinator: &str) -> anyhow::Result<[f64; 2]> {
    use app_core::delivery::{open, receive, request};
    use glam::UVec2;
    let offer = offers(coordinator).await?.remove(0);
    let client = client::Client::connect(coordinator).await?;
    let first_s = async |size_px: UVec2| -> anyhow::Result<f64> {
        let views = path(&offer, 1, size_px)?;
        let start = std::time::Instant::now();
        let session = open(&client, request(offer.settings.clone(), &views)?).await?;
        receive(&session, &views, async |_| Ok(())).await?;
        Ok(start.elapsed().as_secs_f64())
    };
    first_s(UVec2::new(320, 180)).await?;
    Ok([first_s(UVec2::new(320, 180)).await?, first_s(UVec2::new(352, 198)).await?])
}
