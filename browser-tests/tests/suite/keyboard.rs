//! The keyboard alone reaches everything, and everything has a name.

use std::collections::BTreeSet;

use browser::{Browser, Key};
use browser_tests::visit::{Expected, Visit};

use crate::scene::gateway;

/// Whatever a person can use: an identifier for each, those of the page where it has them.
const CONTROLS: &str = "(() => {
    const all = [...document.querySelectorAll('button, select, input, a[href], [tabindex]')];
    const shown = all.filter((element) => element.checkVisibility() && !element.disabled && element.tabIndex >= 0);
    return shown.map((element) => element.id || element.textContent);
})()";
const FOCUSED: &str = "document.activeElement.id || document.activeElement.textContent";

async fn focused(browser: &Browser) -> String {
    browser.value(FOCUSED).await.unwrap()
}

/// Presses Tab until an element has the focus.
async fn tab_to(browser: &Browser, id: &str) {
    for _ in 0..50 {
        if focused(browser).await == id {
            return;
        }
        browser.press(Key::Tab).await.unwrap();
    }
    panic!("no Tab reaches {id}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_keyboard_alone_reaches_and_uses_every_control() {
    let (_bench, url) = gateway().await;
    let visit = Visit::to(&url).await;
    visit.settled().await;
    let browser = &visit.browser;
    for panel in ["more", "show-statistics", "show-keys"] {
        tab_to(browser, panel).await;
        browser.press(Key::Enter).await.unwrap();
        visit.until(&format!("document.getElementById('{panel}').ariaExpanded === 'true'")).await;
    }
    let controls: BTreeSet<String> = browser.value::<Vec<String>>(CONTROLS).await.unwrap().into_iter().collect();
    for id in ["picture", "reset", "fit", "mode", "statistics-close"] {
        assert!(controls.contains(id), "{id} in {controls:?}");
    }
    let mut reached = BTreeSet::new();
    for _ in 0..2 * controls.len() + 4 {
        browser.press(Key::Tab).await.unwrap();
        reached.insert(focused(browser).await);
    }
    let missed: Vec<_> = controls.difference(&reached).collect();
    assert!(missed.is_empty(), "no Tab reaches {missed:?}");
    tab_to(browser, "mode").await;
    browser.press(' ').await.unwrap();
    assert!(visit.state().await.is_flying);
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn every_control_has_a_name_for_screen_readers() {
    let (_bench, url) = gateway().await;
    let visit = Visit::to(&url).await;
    visit.settled().await;
    for panel in ["#more", "#show-statistics", "#show-keys"] {
        visit.browser.click(panel).await.unwrap();
    }
    let nodes = visit.browser.accessible_nodes().await.unwrap();
    // The document itself can have the focus, too.
    let controls: Vec<_> = nodes.iter().filter(|node| node.is_focusable && node.role != "RootWebArea").collect();
    let nameless: Vec<_> = controls.iter().filter(|node| node.name.trim().is_empty()).collect();
    assert!(nameless.is_empty(), "{nameless:#?}");
    assert_eq!(controls.len(), visit.browser.value::<Vec<String>>(CONTROLS).await.unwrap().len(), "{controls:#?}");
    let pictures: Vec<_> = controls.iter().filter(|node| node.role == "application").collect();
    assert_eq!(pictures.len(), 1, "the canvas: {controls:#?}");
    let buttons: BTreeSet<_> = controls.iter().filter(|node| node.role == "button").map(|node| &node.name).collect();
    let all = controls.iter().filter(|node| node.role == "button").count();
    assert!(all >= 9 && buttons.len() == all, "names of their own: {buttons:?}");
    visit.end(Expected::NoError).await;
}
