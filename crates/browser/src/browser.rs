//! One browser: its pages, scripts and console.

use std::path::Path;
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use crate::connection::Connection;
use crate::console::{ConsoleEntry, text_of_exception};
use crate::error::BrowserError;
use crate::options::{BrowserOptions, View};
use crate::process::BrowserProcess;
use crate::profile::Profile;

/// The pause between two looks at a condition.
const POLL: Duration = Duration::from_millis(20);

/// A browser with one page. It ends, with its profile, when it is dropped.
#[derive(Debug)]
pub struct Browser {
    connection: Connection,
    // Dropped in this order: a profile is in use while its browser runs.
    _process: BrowserProcess,
    profile: Profile,
}

impl Browser {
    /// Starts a browser with an empty page.
    ///
    /// # Errors
    /// `chromium` is missing or does not start.
    pub async fn start(options: &BrowserOptions) -> Result<Self, BrowserError> {
        let profile = Profile::new()?;
        let process = BrowserProcess::start(&options.command_line(profile.path()), profile.path()).await?;
        let connection = Connection::open(&process.address).await?;
        let browser = Self { connection, _process: process, profile };
        browser.set_view(options.view).await?;
        Ok(browser)
    }

    /// The folder of its profile.
    #[must_use]
    pub fn profile(&self) -> &Path {
        self.profile.path()
    }

    /// Opens a page, and waits until it is loaded.
    ///
    /// # Errors
    /// The page cannot be reached.
    pub async fn open(&self, url: &str) -> Result<(), BrowserError> {
        let navigation = self.devtools("Page.navigate", json!({ "url": url })).await?;
        if let Some(reason) = navigation["errorText"].as_str() {
            return Err(BrowserError::refused(url, reason));
        }
        // A navigation inside the same document loads nothing.
        match navigation["loaderId"].as_str() {
            Some(loader) => self.connection.wait_for_load(url, loader).await,
            None => Ok(()),
        }
    }

    /// Runs the body of an async function in the page, with `arguments`; returns what it returns.
    ///
    /// # Errors
    /// It throws, or returns something else than a `T`.
    pub async fn run<T: DeserializeOwned>(&self, body: &str, arguments: Vec<Value>) -> Result<T, BrowserError> {
        let arguments = Value::from(arguments);
        let script = json!({
            "expression": format!("(async function () {{ {body} }}).apply(null, {arguments})"),
            "awaitPromise": true,
            "returnByValue": true,
        });
        let mut answer = self.devtools("Runtime.evaluate", script).await?;
        if let Some(details) = answer.get("exceptionDetails") {
            return Err(BrowserError::Thrown { script: body.to_owned(), exception: text_of_exception(details) });
        }
        // `undefined` has no value.
        let value = answer["result"]["value"].take();
        T::deserialize(&value).map_err(|error| BrowserError::answer(body, &value, error))
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
        let script = format!("!!({condition})");
        loop {
            match self.value::<bool>(&script).await {
                Ok(true) => return Ok(()),
                // A page that takes the place of another refuses scripts meanwhile.
                Ok(false) | Err(BrowserError::Refused { .. }) => {}
                Err(error) => return Err(error),
            }
            if start.elapsed() > within {
                return Err(BrowserError::Late { condition: condition.to_owned(), within });
            }
            tokio::time::sleep(POLL).await;
        }
    }

    /// Calls a method of the DevTools protocol.
    ///
    /// # Errors
    /// The browser refuses it.
    pub async fn devtools(&self, method: &str, parameters: Value) -> Result<Value, BrowserError> {
        self.connection.call(method, parameters).await
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
        // All messages before the page's answer have come when it comes.
        self.devtools("Runtime.getHeapUsage", json!({})).await?;
        Ok(self.connection.record().console.clone())
    }
}
