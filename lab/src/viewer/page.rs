//! The page in a browser, as a person uses it: drags, rests, and what the page says of its pictures.

use std::f64::consts::TAU;
use std::time::Duration;

use anyhow::Context as _;
use browser::input::{Drag, Place};
use browser::{Browser, BrowserOptions, View};
use serde::Deserialize;

/// The interval between two moves of the mouse.
const MOVE: Duration = Duration::from_millis(8);
/// The page's pictures from an index on.
const PICTURES: &str = "return window.myriorama.statistics.pictures.slice(arguments[0]).map((p) => ({
    still: p.header.still, is_repeat: p.isRepeat, size_px: p.header.size_px, bytes: p.bytes, age_ms: p.age,
    painted_ms: p.paintedAt, parts_ms: Object.values(p.parts).reduce((sum, part) => sum + part, 0),
    least_part_ms: Math.min(...Object.values(p.parts)), detour_ms: p.parts.network + p.parts.forward,
}))";
/// Notes the time of the last move of the mouse, and the bytes of the longest pose.
const WATCH: &str = "window.lastMove = 0;
    window.longestPose = 0;
    addEventListener('pointermove', (event) => (window.lastMove = event.timeStamp), true);
    const { socket } = window.myriorama.link;
    const send = socket.send.bind(socket);
    socket.send = (text) => {
        if (text.includes('\"pose\"')) window.longestPose = Math.max(window.longestPose, text.length);
        send(text);
    };";
const IS_FINISHED: &str = "(() => {
    const last = window.myriorama?.statistics.pictures.at(-1)?.header;
    return last && last.still && !last.more && last.number === window.myriorama.number();
})()";

/// A picture on the screen, by the page's clock.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct Picture {
    pub(super) still: bool,
    /// Whether its pose was shown before.
    pub(super) is_repeat: bool,
    pub(super) size_px: [u32; 2],
    pub(super) bytes: f64,
    /// From the input event to the screen.
    pub(super) age_ms: f64,
    pub(super) painted_ms: f64,
    /// The sum of its age's parts.
    pub(super) parts_ms: f64,
    pub(super) least_part_ms: f64,
    /// Between page and gateway, and in the gateway after its arrival: a client of gRPC has neither.
    pub(super) detour_ms: f64,
}

/// A page in a browser of its own.
pub(super) struct Page {
    pub(super) browser: Browser,
    size_px: [u32; 2],
}

impl Page {
    /// A browser with an empty page of this size.
    ///
    /// # Errors
    /// There is no browser.
    pub(super) async fn start(size_px: [u32; 2]) -> anyhow::Result<Self> {
        let view = View { size_px, ..View::default() };
        let browser = Browser::start(&BrowserOptions { view, ..BrowserOptions::default() }).await;
        let browser = browser.context("no browser: scripts/ensure-browser.sh installs chromium")?;
        Ok(Self { browser, size_px })
    }

    /// Waits until the newest pose's finished still is on the screen.
    pub(super) async fn wait_for_finished(&self, within: Duration) -> anyhow::Result<()> {
        Ok(self.browser.wait_until(IS_FINISHED, within).await?)
    }

    /// Begins to note times and bytes.
    pub(super) async fn watch(&self) -> anyhow::Result<()> {
        Ok(self.browser.run(&format!("{WATCH} return null"), Vec::new()).await?)
    }

    pub(super) async fn picture_count(&self) -> anyhow::Result<usize> {
        Ok(self.browser.value("window.myriorama.statistics.pictures.length").await?)
    }

    pub(super) async fn pictures_since(&self, index: usize) -> anyhow::Result<Vec<Picture>> {
        Ok(self.browser.run(PICTURES, vec![index.into()]).await?)
    }

    /// The poses' first pictures in motion from an index on.
    pub(super) async fn moving_since(&self, index: usize) -> anyhow::Result<Vec<Picture>> {
        let pictures = self.pictures_since(index).await?;
        Ok(pictures.into_iter().filter(|picture| !picture.still && !picture.is_repeat).collect())
    }

    /// The page's clock, in milliseconds.
    pub(super) async fn now_ms(&self) -> anyhow::Result<f64> {
        Ok(self.browser.value("performance.now()").await?)
    }

    /// Drags for some seconds along an eight around the middle of the upper half, and gives the poses' first pictures in motion
    /// that have come meanwhile.
    pub(super) async fn drag(&self, seconds: f64) -> anyhow::Result<Vec<Picture>> {
        let before = self.picture_count().await?;
        let start = std::time::Instant::now();
        let steps = (seconds / MOVE.as_secs_f64()).ceil() as usize;
        // Moves take longer where the machine is busy: the drag ends in time all the same.
        let mut at = 0;
        while at < steps && start.elapsed().as_secs_f64() < seconds {
            let path = (at..steps.min(at + 25) + 1).map(|step| self.place(step)).collect();
            self.browser.drag(&Drag { interval: MOVE, ..Drag::along(path) }).await?;
            at += 25;
        }
        self.moving_since(before).await
    }

    /// Turns around the pivot by a share of a full turn: a drag over the canvas's height is half a turn.
    pub(super) async fn turn(&self, share: f64, seconds: f64) -> anyhow::Result<()> {
        let [width, height] = self.size_px.map(f64::from);
        let length = 2.0 * height * share;
        let steps = (seconds * 50.0).max(2.0) as usize;
        let interval = Duration::from_secs_f64(seconds / steps as f64);
        let path = (0..=steps).map(|step| [width * 0.1 + length * step as f64 / steps as f64, height * 0.4]).collect();
        Ok(self.browser.drag(&Drag { interval, ..Drag::along(path) }).await?)
    }

    fn place(&self, step: usize) -> Place {
        let [width, height] = self.size_px.map(f64::from);
        let turn = step as f64 / 250.0 * TAU;
        [width * (0.5 + 0.3 * turn.sin()), height * (0.35 + 0.15 * (2.0 * turn).sin())]
    }
}

/// The greatest time between pictures that follow one another, from `since_ms` to `until_ms`.
pub(super) fn longest_gap_s(pictures: &[Picture], since_ms: f64, until_ms: f64) -> f64 {
    let painted = pictures.iter().map(|picture| picture.painted_ms).filter(|&at| at >= since_ms && at <= until_ms);
    let times: Vec<f64> = [since_ms].into_iter().chain(painted).chain([until_ms]).collect();
    times.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max) / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_lasts_to_the_end_where_no_picture_follows() {
        let at = |painted_ms: f64| Picture {
            still: false,
            is_repeat: false,
            size_px: [1, 1],
            bytes: 0.0,
            age_ms: 0.0,
            painted_ms,
            parts_ms: 0.0,
            least_part_ms: 0.0,
            detour_ms: 0.0,
        };
        let pictures = [100.0, 400.0, 450.0].map(at);
        assert!((longest_gap_s(&pictures, 50.0, 500.0) - 0.3).abs() < 1e-9);
        assert!((longest_gap_s(&pictures, 50.0, 2450.0) - 2.0).abs() < 1e-9);
        assert!((longest_gap_s(&[], 0.0, 1000.0) - 1.0).abs() < 1e-9);
    }
}
