//! A page tells no event from a person's, its console is read, and a browser leaves no process behind.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::time::{Duration, Instant};

use browser::input::{Drag, TouchPhase};
use browser::{Browser, BrowserError, BrowserOptions, Key, View};
use serde_json::json;

const SOON: Duration = Duration::from_secs(10);

/// A page that keeps the events of its canvas, which is half red and half blue.
const PAGE: &str = "data:text/html,<!doctype html><title>Page</title>
    <body style='margin:0'><canvas width=4 height=2 tabindex=0 style='width:100px;height:100px;touch-action:none'
    aria-label='A picture' role=img></canvas><button style='width:50px;height:20px'>Press</button><script>
    const canvas = document.querySelector('canvas'), context = canvas.getContext('2d');
    context.fillStyle = 'red'; context.fillRect(0, 0, 2, 2); context.fillStyle = 'blue'; context.fillRect(2, 0, 2, 2);
    window.events = [];
    const keep = (event) => window.events.push([event.type, event.pointerType ?? event.key ?? '', event.isTrusted]);
    for (const name of ['pointerdown', 'pointermove', 'pointerup', 'wheel', 'keydown', 'keyup'])
        addEventListener(name, keep);
    document.querySelector('button').onclick = () => { window.isPressed = true };
    </script>";

async fn opened(view: View) -> Browser {
    let browser = Browser::start(&BrowserOptions { view, ..BrowserOptions::default() }).await.unwrap();
    browser.open(PAGE).await.unwrap();
    browser
}

/// The events since the last call: `type:pointer` or `type:key`, all of them trusted.
async fn events(browser: &Browser) -> Vec<String> {
    let events: Vec<(String, String, bool)> =
        browser.run("const seen = window.events; window.events = []; return seen", Vec::new()).await.unwrap();
    assert!(events.iter().all(|(.., is_trusted)| *is_trusted));
    events.into_iter().map(|(name, by, _)| format!("{name}:{by}")).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_hears_mouse_fingers_wheel_and_keys() {
    let browser = opened(View { is_touch: true, ..View::default() }).await;
    browser.drag(&Drag::along(vec![[20.0, 20.0], [40.0, 20.0], [60.0, 20.0]])).await.unwrap();
    let drag = ["pointerdown:mouse", "pointermove:mouse", "pointermove:mouse", "pointerup:mouse"];
    assert_eq!(events(&browser).await, drag);
    browser.wheel([20.0, 20.0], 100.0).await.unwrap();
    browser.wait_until("window.events.length === 1", SOON).await.unwrap();
    assert!(events(&browser).await[0].starts_with("wheel"));
    browser.touch(TouchPhase::Start, &[[20.0, 20.0]]).await.unwrap();
    browser.touch(TouchPhase::Move, &[[70.0, 70.0]]).await.unwrap();
    browser.touch(TouchPhase::End, &[]).await.unwrap();
    assert_eq!(events(&browser).await, ["pointerdown:touch", "pointermove:touch", "pointerup:touch"]);
    browser.press('a').await.unwrap();
    browser.press(Key::Tab).await.unwrap();
    assert_eq!(events(&browser).await, ["keydown:a", "keyup:a", "keydown:Tab", "keyup:Tab"]);
    browser.click("button").await.unwrap();
    browser.wait_until("window.isPressed", SOON).await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn keys_have_the_names_of_a_us_keyboard_and_type_their_text() {
    const PAGE: &str = "data:text/html,<!doctype html><textarea></textarea><script>
        window.keys = [];
        const keep = (event) => window.keys.push([event.key, event.code, event.keyCode, event.shiftKey]);
        addEventListener('keydown', keep);
        document.querySelector('textarea').focus();
        </script>";
    let browser = Browser::start(&BrowserOptions::default()).await.unwrap();
    browser.open(PAGE).await.unwrap();
    for key in ['w', 'W', '7', ' ', '+', '-'].map(Key::from).into_iter().chain([Key::Enter, Key::Home]) {
        browser.press(key).await.unwrap();
    }
    let keys: Vec<(String, String, u32, bool)> = browser.value("window.keys").await.unwrap();
    let expected = [
        ("w", "KeyW", 87, false),
        ("W", "KeyW", 87, true),
        ("7", "Digit7", 55, false),
        (" ", "Space", 32, false),
        ("+", "Equal", 187, true),
        ("-", "Minus", 189, false),
        ("Enter", "Enter", 13, false),
        ("Home", "Home", 36, false),
    ];
    assert_eq!(keys, expected.map(|(key, code, number, shift)| (key.to_owned(), code.to_owned(), number, shift)));
    let text: String = browser.value("document.querySelector('textarea').value").await.unwrap();
    assert_eq!(text, "wW7 +-\n");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_that_replaces_itself_while_it_loads_is_waited_for() {
    const PAGE: &str = "data:text/html,<script>location.replace('about:blank')</script><p>never seen";
    let browser = Browser::start(&BrowserOptions::default()).await.unwrap();
    for url in ["about:blank", "about:blank", "about:blank#part", PAGE, "about:blank"] {
        browser.open(url).await.unwrap();
    }
    let error = browser.open("http://127.0.0.1:1/").await.unwrap_err();
    assert!(error.to_string().contains("net::ERR_"), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn commands_are_in_flight_at_once_and_end_with_their_page() {
    let browser = opened(View::default()).await;
    let waiting = browser.run::<u32>("return await new Promise((resolve) => { window.resolve = resolve })", Vec::new());
    let (answer, ()) = tokio::join!(waiting, async { browser.run("resolve(7)", Vec::new()).await.unwrap() });
    assert_eq!(answer.unwrap(), 7);
    let waiting = browser.run::<()>("await new Promise(() => {})", Vec::new());
    let (answer, crash) = tokio::join!(waiting, browser.devtools("Page.crash", json!({})));
    assert!(matches!(answer, Err(BrowserError::Ended { .. })), "{answer:?}");
    assert!(matches!(crash, Err(BrowserError::Ended { .. })), "{crash:?}");
    assert!(matches!(browser.open(PAGE).await, Err(BrowserError::Ended { .. })));
}

#[tokio::test(flavor = "multi_thread")]
async fn errors_of_a_page_are_seen() {
    let browser = opened(View::default()).await;
    assert!(browser.console().await.unwrap().iter().all(|entry| !entry.is_error));
    browser.run::<()>("setTimeout(() => { throw new Error('a fault') })", Vec::new()).await.unwrap();
    let start = Instant::now();
    while !browser.console().await.unwrap().iter().any(|entry| entry.is_error && !entry.is_of_network()) {
        assert!(start.elapsed() < SOON, "no error on the console");
    }
    let thrown = browser.value::<u32>("nothing.there").await.unwrap_err();
    assert!(thrown.to_string().contains("nothing is not defined"), "{thrown}");
    assert!(matches!(browser.value::<u32>("'text'").await, Err(BrowserError::Answer { .. })));
    let late = browser.wait_until("1 > 2", Duration::from_millis(50)).await;
    assert!(matches!(late, Err(BrowserError::Late { .. })));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_is_inspected_as_a_person_would() {
    let browser = opened(View { size_px: [300, 200], scale: 2.0, is_touch: false }).await;
    let view: (u32, u32, f64) = browser.value("[innerWidth, innerHeight, devicePixelRatio]").await.unwrap();
    assert_eq!(view, (300, 200, 2.0));
    let canvas = browser.canvas("canvas").await.unwrap();
    assert_eq!((canvas.size_px, &canvas.srgb8[..12]), ([4, 2], &[255, 0, 0, 255, 0, 0, 0, 0, 255, 0, 0, 255][..]));
    let nodes = browser.accessible_nodes().await.unwrap();
    for name in ["A picture", "Press"] {
        assert!(nodes.iter().any(|node| node.name == name && node.is_focusable), "{name} in {nodes:#?}");
    }
    assert!(browser.screenshot_png().await.unwrap().starts_with(b"\x89PNG"));
    let before = browser.heap_bytes().await.unwrap();
    browser.run::<()>("window.kept = new Array(1e6).fill(0.5)", Vec::new()).await.unwrap();
    assert!(browser.heap_bytes().await.unwrap() > before + 4e6);
    browser.run::<()>("window.kept = new Uint8Array(8e6)", Vec::new()).await.unwrap();
    assert!(browser.heap_bytes().await.unwrap() > before + 7.9e6);
}

/// Processes whose command line has a text.
fn processes_with(text: &str) -> usize {
    let folders = fs::read_dir("/proc").unwrap().filter_map(Result::ok);
    let lines = folders.filter_map(|folder| fs::read(folder.path().join("cmdline")).ok());
    lines.filter(|line| String::from_utf8_lossy(line).contains(text)).count()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_browser_that_is_dropped_leaves_nothing_behind() {
    let browser = opened(View::default()).await;
    let profile = browser.profile().to_str().unwrap().to_owned();
    assert!(processes_with(&profile) > 0 && fs::exists(&profile).unwrap());
    drop(browser);
    let start = Instant::now();
    while processes_with(&profile) > 0 {
        assert!(start.elapsed() < SOON, "processes of {profile}");
    }
    assert!(!fs::exists(&profile).unwrap());
}
