//! One browser: its pages, scripts and console.

use std::path::Path;
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use thirtyfour::{Capabilities, WebDriver};

use crate::console::ConsoleEntry;
use crate::error::BrowserError;
use crate::options::{BrowserOptions, View};
use crate::process::{DriverProcess, program};
use crate::profile::Profile;

/// The pause between two looks at a condition.
const POLL: Duration = Duration::from_millis(20);

/// A browser with one page. It ends, with its driver and its profile, when it is dropped.
#[derive(Debug)]
pub struct Browser {
    /// Absent only while it is dropped.
    driver: Option<WebDriver>,
    console: Mutex<Vec<ConsoleEntry>>,
    // Dropped in this order: a profile is in use while its browser runs.
    _process: DriverProcess,
    profile: Profile,
}

impl Drop for Browser {
    fn drop(&mut self) {
        // The process is killed: no farewell, which would block this thread, is needed.
        let _ = self.driver.take().map(WebDriver::leak);
    }
}

impl Browser {
    /// Starts a browser with an empty page.
    ///
    /// # Errors
    /// `chromium` or `chromedriver` is missing or does not start.
    pub async fn start(options: &BrowserOptions) -> Result<Self, BrowserError> {
        let chromium = program("chromium")?;
        let profile = Profile::new()?;
        let process = DriverProcess::start().await?;
        let wanted = json!({
            "browserName": "chrome",
            "goog:chromeOptions": { "binary": chromium, "args": options.command_line(profile.path()) },
            "goog:loggingPrefs": { "browser": "ALL" },
        });
        let Value::Object(wanted) = wanted else { unreachable!("an object") };
        let driver = WebDriver::new(&*process.address, Capabilities::from(wanted)).await;
        let driver = Some(driver.map_err(|error| BrowserError::command("a new session", error))?);
        let browser = Self { driver, console: Mutex::default(), _process: process, profile };
        browser.set_view(options.view).await?;
        Ok(browser)
    }

    /// The folder of its profile.
    #[must_use]
    pub fn profile(&self) -> &Path {
        self.profile.path()
    }

    pub(crate) fn driver(&self) -> &WebDriver {
        self.driver.as_ref().expect("a driver until it is dropped")
    }

    /// Opens a page, and waits until it is loaded.
    ///
    /// # Errors
    /// The page cannot be reached.
    pub async fn open(&self, url: &str) -> Result<(), BrowserError> {
        self.driver().goto(url).await.map_err(|error| BrowserError::command(url, error))
    }

    /// Runs the body of an async function in the page, with `arguments`; returns what it returns.
    ///
    /// # Errors
    /// It throws, or returns something else than a `T`.
    pub async fn run<T: DeserializeOwned>(&self, body: &str, arguments: Vec<Value>) -> Result<T, BrowserError> {
        let script = format!("return (async function () {{ {body} }}).apply(null, arguments)");
        let answer = self.driver().execute(script, arguments).await;
        let answer = answer.map_err(|error| BrowserError::command(body, error))?;
        let value = answer.json();
        serde_json::from_value(value.clone()).map_err(|error| BrowserError::answer(body, value, error))
    }

    /// The value of an expression in the page.
    ///
    /// # Errors
    /// As [`Browser::run`].
    pub async fn value<T: DeserializeOwned>(&self, expression: &str) -> Result<T, BrowserError> {
        self.run(&format!("return {expression}"), Vec::new()).await
    }

    /// Waits until an expression is true.
    ///
    /// # Errors
    /// It throws, or takes longer.
    pub async fn wait_until(&self, condition: &str, within: Duration) -> Result<(), BrowserError> {
        let start = Instant::now();
        while !self.value::<bool>(&format!("!!({condition})")).await? {
            if start.elapsed() > within {
                return Err(BrowserError::Late { condition: condition.to_owned(), within });
            }
            tokio::time::sleep(POLL).await;
        }
        Ok(())
    }

    /// Calls a method of the DevTools protocol.
    ///
    /// # Errors
    /// The browser refuses it.
    pub async fn devtools(&self, method: &str, parameters: Value) -> Result<Value, BrowserError> {
        let answer = self.driver().cdp().send_raw(method, parameters).await;
        answer.map_err(|error| BrowserError::command(method, error))
    }

    /// Changes the size and the pixels of the page's view.
    ///
    /// # Errors
    /// The browser refuses it.
    pub async fn set_view(&self, view: View) -> Result<(), BrowserError> {
        let [width, height] = view.size_px;
        let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": view.scale, "mobile": false });
        self.devtools("Emulation.setDeviceMetricsOverride", metrics).await?;
        let touch = json!({ "enabled": view.is_touch, "maxTouchPoints": 5 });
        self.devtools("Emulation.setTouchEmulationEnabled", touch).await.map(drop)
    }

    /// All messages of the console so far.
    ///
    /// # Errors
    /// The browser does not answer.
    pub async fn console(&self) -> Result<Vec<ConsoleEntry>, BrowserError> {
        let new = self.driver().browser_log().await;
        let new = new.map_err(|error| BrowserError::command("the console", error))?;
        let mut console = self.console.lock();
        console.extend(new.into_iter().map(ConsoleEntry::from));
        Ok(console.clone())
    }
}
