//! `view` of many large pictures: the memory of the client, and the time of the first file.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use report::{Bar, Cell, Check, Table};

use super::up::{Up, policies};
use crate::memory::peak_memory_mb_of;
use crate::process::product;
use crate::section::Section;

/// The most memory of the client.
const MEMORY_MB: f64 = 500.0;
/// The longest time until the first file.
const FIRST_FILE_S: f64 = 5.0;
const VIEWS: usize = 500;
/// As many views as a measurement of costs is of.
const WARM_UP: usize = 32;
/// The time between two looks at the client.
const LOOK: Duration = Duration::from_millis(20);

/// A finished `view`.
struct Viewed {
    peak_memory_mb: f64,
    first_file_s: f64,
    seconds: f64,
}

/// Asks for some views, so that costs are known, then for all of them.
///
/// # Errors
/// A process does not start, or `view` fails.
pub(super) async fn measure(cluster: &[String], out: &Path) -> anyhow::Result<Section> {
    let up = Up::start(cluster).await?;
    let folder = out.join("many-views");
    view(&up.coordinator, WARM_UP, &folder).await?;
    let viewed = view(&up.coordinator, VIEWS, &folder);
    let policy = async {
        // The session is open by then: its first view takes longer.
        tokio::time::sleep(Duration::from_secs(2)).await;
        policies(&up.coordinator).await
    };
    let (viewed, policy) = tokio::join!(viewed, policy);
    section(&viewed?, policy?, up.device.clone())
}

/// Runs `view` to its end. Its pictures are removed.
async fn view(coordinator: &str, views: usize, folder: &Path) -> anyhow::Result<Viewed> {
    remove(folder)?;
    let start = Instant::now();
    let mut child = started(coordinator, views, folder)?;
    let id = child.id().to_string();
    let (mut peak_memory_mb, mut first_file_s) = (0.0, f64::INFINITY);
    let status = loop {
        peak_memory_mb = peak_memory_mb_of(&id).unwrap_or(peak_memory_mb);
        if first_file_s.is_infinite() && has_picture(folder) {
            first_file_s = start.elapsed().as_secs_f64();
        }
        if let Some(status) = child.try_wait()? {
            break status;
        }
        tokio::time::sleep(LOOK).await;
    };
    let seconds = start.elapsed().as_secs_f64();
    remove(folder)?;
    anyhow::ensure!(status.success(), "view ended with {status}");
    Ok(Viewed { peak_memory_mb, first_file_s, seconds })
}

fn started(coordinator: &str, views: usize, folder: &Path) -> anyhow::Result<Child> {
    let mut command = Command::new(product()?);
    command.args(["view", "--coordinator", coordinator, "--views", &views.to_string(), "--size", "1920x1080"]);
    command
        .args(["--antialias", "1", "--exposure", "0", "--tone-map", "none"])
        .args(["--depth", "--provenance", "--policy", "pipeline", "--out"])
        .arg(folder)
        .stdout(Stdio::null());
    command.spawn().context("cannot start view")
}

fn has_picture(folder: &Path) -> bool {
    let name = |file: PathBuf| file.extension().is_some_and(|ending| ending == "png");
    folder.read_dir().is_ok_and(|mut files| files.any(|file| file.is_ok_and(|file| name(file.path()))))
}

fn remove(folder: &Path) -> anyhow::Result<()> {
    if folder.exists() {
        std::fs::remove_dir_all(folder).with_context(|| format!("cannot remove {}", folder.display()))?;
    }
    Ok(())
}

fn section(viewed: &Viewed, policy: String, device: String) -> anyhow::Result<Section> {
    let columns =
        [("request", ""), ("policy", ""), ("client's peak memory", "MB"), ("first file", "s"), ("all files", "s")];
    let name = format!("{VIEWS} views of 1920×1080 with depth and provenance");
    let mut table = Table::new("Many large views", &columns);
    let numbers = [viewed.peak_memory_mb, viewed.first_file_s, viewed.seconds].map(Cell::from);
    table.push([Cell::from(name.clone()), policy.into()].into_iter().chain(numbers))?;
    let memory = Check::new(format!("{name}: client's memory"), viewed.peak_memory_mb, "MB", Bar::AtMost(MEMORY_MB));
    let first = Check::new(format!("{name}: first file"), viewed.first_file_s, "s", Bar::AtMost(FIRST_FILE_S));
    Ok(Section { device, tables: vec![table], checks: vec![memory, first] })
}
