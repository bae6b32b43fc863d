//! Settings of a browser.

/// The part of a window that shows the page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Columns and rows in CSS pixels.
    pub size_px: [u32; 2],
    /// Device pixels of a CSS pixel's side.
    pub scale: f64,
    /// Whether it is a screen for fingers.
    pub is_touch: bool,
}

impl Default for View {
    fn default() -> Self {
        Self { size_px: [640, 480], scale: 1.0, is_touch: false }
    }
}

/// Settings of a browser.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BrowserOptions {
    /// The first view.
    pub view: View,
    /// Further arguments of `chromium`.
    pub arguments: Vec<String>,
}

/// The arguments of every browser. A page in the background goes on at full speed: two browsers may share a machine without a
/// screen. A container has no right to make sandboxes. Nothing but the page uses the network or a store of passwords, and
/// input reaches a page before its first frame.
const ARGUMENTS: [&str; 14] = [
    "--headless=new",
    "--remote-debugging-port=0",
    "--no-sandbox",
    "--no-first-run",
    "--disable-background-timer-throttling",
    "--disable-renderer-backgrounding",
    "--disable-backgrounding-occluded-windows",
    "--disable-background-networking",
    "--disable-sync",
    "--disable-breakpad",
    "--disable-dev-shm-usage",
    "--password-store=basic",
    "--allow-pre-commit-input",
    "--force-color-profile=srgb",
];

impl BrowserOptions {
    /// The command line of `chromium`, which opens an empty page.
    pub(crate) fn command_line(&self, profile: &std::path::Path) -> Vec<String> {
        let View { size_px: [columns, rows], scale, .. } = self.view;
        let own = [
            format!("--user-data-dir={}", profile.display()),
            format!("--window-size={columns},{rows}"),
            format!("--force-device-scale-factor={scale}"),
            "about:blank".to_owned(),
        ];
        ARGUMENTS.map(str::to_owned).into_iter().chain(self.arguments.iter().cloned()).chain(own).collect()
    }
}
