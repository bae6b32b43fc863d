//! A page of the gateway in a browser of its own.

use std::collections::BTreeMap;
use std::thread::panicking;
use std::time::Duration;

use browser::input::Place;
use browser::inspect::Pixels;
use browser::{Browser, BrowserOptions, Key, View};
use cluster_tests::gateway_bench::PageCamera;
use serde::Deserialize;
use tokio::sync::{Semaphore, SemaphorePermit};

use crate::walk::State;

/// The time within which a page does what it should, on a busy machine.
pub const SOON: Duration = Duration::from_secs(60);

/// Browsers at a time: each takes a core and some 300 MB.
static PLACES: Semaphore = Semaphore::const_new(2);

/// Whether the newest picture is the exact one of the camera, as the page shows it.
const IS_SETTLED: &str = "(() => {
    const page = window.myriorama;
    const state = page?.state();
    const last = page?.statistics.pictures.at(-1)?.header;
    if (!state || !last?.still || last.samples !== 16 || last.number !== page.number() || page.shown() !== last.number) return false;
    const camera = page.camera.toCamera(state);
    const numbers = (c) => [...c.eye, ...c.target, c.fov_y_deg];
    const [shown, wanted] = [numbers(last.camera), numbers(camera)];
    return shown.every((v, i) => Math.abs(v - wanted[i]) < 1e-9)
        && last.size_px.every((side, axis) => side === page.screen.size[axis]);
})()";

/// The state of a page that does not settle, for the message of a failed test.
const SEEN: &str = "[myriorama.number(), myriorama.shown(), document.getElementById('banner').textContent,
    JSON.stringify(myriorama.state()), JSON.stringify(myriorama.statistics.pictures.at(-1)?.header)]";

/// A page in a browser of its own. [`Visit::end`] is its last call.
#[derive(Debug)]
pub struct Visit {
    /// The browser.
    pub browser: Browser,
    has_ended: bool,
    _place: SemaphorePermit<'static>,
}

impl Drop for Visit {
    fn drop(&mut self) {
        assert!(self.has_ended || panicking(), "the console of this page was not read");
    }
}

/// A picture that a page has shown.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Picture {
    /// What came with it.
    pub header: Header,
    /// From the input event to the screen, in ms.
    pub age: f64,
    /// The parts of its age, in ms.
    pub parts: BTreeMap<String, f64>,
    /// Whether its pose was shown before.
    pub is_repeat: bool,
    /// The page's time when it was painted, in ms.
    pub painted_at: f64,
}

/// The header of a picture, as far as tests read it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Header {
    /// The number of its pose.
    pub number: u64,
    /// Whether it is lossless.
    pub still: bool,
    /// Columns and rows.
    pub size_px: [u32; 2],
    /// Its camera.
    pub camera: Camera,
    /// The step of its light, from 1.
    pub light_step: u32,
    /// Samples a pixel.
    pub samples: u32,
    /// The node that made it.
    pub compositor: String,
}

/// A camera in a header.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Camera {
    eye: [f64; 3],
    target: [f64; 3],
    fov_y_deg: f64,
}

impl From<Camera> for PageCamera {
    fn from(Camera { eye, target, fov_y_deg }: Camera) -> Self {
        Self { eye, target, fov_y_deg }
    }
}

/// Errors that a page may have had.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// None.
    NoError,
    /// Those of a connection that the test has cut.
    LostConnections,
}

impl Visit {
    /// Opens a page in a view of 640×480 pixels.
    pub async fn to(url: &str) -> Self {
        Self::in_view(url, View::default()).await
    }

    /// Opens a page in a view.
    ///
    /// # Panics
    /// There is no browser, or no page.
    pub async fn in_view(url: &str, view: View) -> Self {
        Self::with(url, BrowserOptions { view, ..BrowserOptions::default() }).await
    }

    /// Opens a page in a browser with these options.
    ///
    /// # Panics
    /// As [`Visit::in_view`].
    pub async fn with(url: &str, options: BrowserOptions) -> Self {
        let place = PLACES.acquire().await.expect("never closed");
        Self::at(place, url, &options).await
    }

    /// As [`Visit::in_view`], while no other page is open: for measured times.
    ///
    /// # Panics
    /// As [`Visit::in_view`].
    pub async fn alone(url: &str, view: View) -> Self {
        let places = PLACES.acquire_many(2).await.expect("never closed");
        Self::at(places, url, &BrowserOptions { view, ..BrowserOptions::default() }).await
    }

    /// Opens two pages, each in a browser of its own.
    ///
    /// # Panics
    /// As [`Visit::in_view`].
    pub async fn two(url: &str) -> [Self; 2] {
        // Both places at once: a test that waits for its second one with its first could wait for ever.
        let mut one = PLACES.acquire_many(2).await.expect("never closed");
        let other = one.split(1).expect("two places");
        let options = BrowserOptions::default();
        let (one, other) = tokio::join!(Self::at(one, url, &options), Self::at(other, url, &options));
        [one, other]
    }

    async fn at(place: SemaphorePermit<'static>, url: &str, options: &BrowserOptions) -> Self {
        let browser = Browser::start(options).await.expect("a browser");
        browser.open(url).await.expect("a page");
        Self { browser, has_ended: false, _place: place }
    }

    /// Waits until an expression of the page is true.
    ///
    /// # Panics
    /// It takes longer than [`SOON`].
    pub async fn until(&self, condition: &str) {
        self.browser.wait_until(condition, SOON).await.expect("it comes true");
    }

    /// Waits until the exact picture of the camera is on the screen.
    ///
    /// # Panics
    /// It takes longer than [`SOON`].
    pub async fn rested(&self) {
        if let Err(error) = self.browser.wait_until(IS_SETTLED, SOON).await {
            panic!("{error}: {:?}", self.browser.value::<serde_json::Value>(SEEN).await);
        }
    }

    /// As [`Visit::rested`]; returns the picture.
    ///
    /// # Panics
    /// As [`Visit::rested`].
    pub async fn settled(&self) -> Picture {
        self.rested().await;
        self.browser.value("myriorama.statistics.pictures.at(-1)").await.expect("a picture")
    }

    /// As [`Visit::settled`]; with the pixels of that picture, and of none that came after it.
    ///
    /// # Panics
    /// As [`Visit::settled`].
    pub async fn settled_canvas(&self) -> (Picture, Pixels) {
        loop {
            let still = self.settled().await;
            let canvas = self.canvas().await;
            if self.settled().await == still {
                return (still, canvas);
            }
        }
    }

    /// The pictures so far.
    ///
    /// # Panics
    /// The page has none of its statistics.
    pub async fn pictures(&self) -> Vec<Picture> {
        self.browser.value("myriorama.statistics.pictures").await.expect("pictures")
    }

    /// The number of pictures so far.
    ///
    /// # Panics
    /// As [`Visit::pictures`].
    pub async fn picture_count(&self) -> usize {
        self.browser.value("myriorama.statistics.pictures.length").await.expect("a number")
    }

    /// The camera.
    ///
    /// # Panics
    /// The page has none yet.
    pub async fn state(&self) -> State {
        self.browser.value("myriorama.state()").await.expect("a camera")
    }

    /// The text of the element that a CSS selector finds.
    ///
    /// # Panics
    /// There is none.
    pub async fn text(&self, selector: &str) -> String {
        let text = "return document.querySelector(arguments[0]).textContent";
        self.browser.run(text, vec![selector.into()]).await.expect("a text")
    }

    /// Whether the element that a CSS selector finds is on the page.
    ///
    /// # Panics
    /// There is none.
    pub async fn is_shown(&self, selector: &str) -> bool {
        let is_shown = "return document.querySelector(arguments[0]).checkVisibility()";
        self.browser.run(is_shown, vec![selector.into()]).await.expect("an element")
    }

    /// Presses a key while the picture has the focus.
    ///
    /// # Panics
    /// The page has no picture.
    pub async fn press(&self, key: impl Into<Key>) {
        self.browser.run::<()>("document.getElementById('picture').focus()", Vec::new()).await.expect("a picture");
        self.browser.press(key).await.expect("a key");
    }

    /// Clicks on the picture, once or twice.
    ///
    /// # Panics
    /// Something else lies above it.
    pub async fn click_picture(&self, place: Place, times: u32) {
        let found = "return document.elementFromPoint(...arguments)?.id";
        let found: Option<String> = self.browser.run(found, place.map(Into::into).to_vec()).await.expect("an element");
        assert_eq!(found.as_deref(), Some("picture"), "at {place:?}");
        self.browser.click_at(place, times).await.expect("a click");
    }

    /// The pixels on the screen.
    ///
    /// # Panics
    /// The page has no canvas.
    pub async fn canvas(&self) -> Pixels {
        self.browser.canvas("#picture").await.expect("pixels")
    }

    /// Ends the visit, which must have had no error on its console but those that are expected.
    ///
    /// # Panics
    /// It had others.
    pub async fn end(mut self, expected: Expected) {
        let console = self.browser.console().await.expect("a console");
        let is_expected = |of_network| of_network && expected == Expected::LostConnections;
        let wrong: Vec<_> =
            console.iter().filter(|entry| entry.is_error && !is_expected(entry.is_of_network())).collect();
        assert!(wrong.is_empty(), "{wrong:#?}");
        self.has_ended = true;
    }
}
