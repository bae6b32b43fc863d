//! Mouse, wheel, fingers and keys move the camera as the closed forms say.

use std::time::Duration;

use browser::input::{Drag, MouseButton, Place, TouchPhase};
use browser::{Key, View};
use browser_tests::visit::{Expected, Visit};
use browser_tests::walk::State;
use serde_json::json;

use crate::scene::gateway;

/// The height of the canvas.
const HEIGHT_PX: f64 = 480.0;
/// The share of the scene's size that a second of flight takes.
const FLIGHT_PER_S: f64 = 0.25;
/// The time of an animation frame.
const FRAME_S: f64 = 1.0 / 60.0;

fn assert_same(seen: State, expected: State) {
    assert!(seen.difference(&expected) < 1e-9, "{seen:#?} instead of {expected:#?}");
    assert_eq!(seen.is_flying, expected.is_flying);
}

fn steps(from: Place, to: Place, count: u32) -> Vec<Place> {
    let at = |step: u32, axis: usize| from[axis] + (to[axis] - from[axis]) * f64::from(step) / f64::from(count);
    (0..=count).map(|step| [at(step, 0), at(step, 1)]).collect()
}

/// Drags, and compares the camera with its closed form.
async fn check_drag(visit: &Visit, drag: Drag, form: fn(State, Place, Place, f64) -> State) {
    let before = visit.state().await;
    visit.browser.drag(&drag).await.unwrap();
    let expected = form(before, drag.path[0], *drag.path.last().unwrap(), HEIGHT_PX);
    assert!(expected.difference(&before) > 1e-3, "it moves");
    assert_same(visit.state().await, expected);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_mouse_turns_pans_and_comes_closer() {
    let (_bench, url) = gateway().await;
    let visit = Visit::to(&url).await;
    visit.settled().await;
    let path = || steps([320.0, 240.0], [400.0, 280.0], 8);
    check_drag(&visit, Drag::along(path()), State::dragged).await;
    check_drag(&visit, Drag { button: MouseButton::Right, ..Drag::along(path()) }, State::panned).await;
    check_drag(&visit, Drag { is_shifted: true, ..Drag::along(path()) }, State::panned).await;
    // Up to the steepest angle, and no farther.
    check_drag(&visit, Drag::along(steps([320.0, 20.0], [320.0, 470.0], 9)), State::dragged).await;
    let before = visit.state().await;
    visit.browser.wheel([320.0, 240.0], -200.0).await.unwrap();
    visit.browser.wheel([320.0, 240.0], 50.0).await.unwrap();
    assert_same(visit.state().await, before.wheeled(-200.0).wheeled(50.0));
    visit.settled().await;
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_flying_camera_looks_around_from_its_place() {
    let (_bench, url) = gateway().await;
    let visit = Visit::to(&url).await;
    visit.settled().await;
    visit.browser.click("#mode").await.unwrap();
    let before = visit.state().await;
    assert!(before.is_flying);
    check_drag(&visit, Drag::along(steps([320.0, 240.0], [380.0, 200.0], 6)), State::dragged).await;
    let turned = visit.state().await;
    assert!((turned.eye() - before.eye()).length() < 1e-9, "the eye stays");
    visit.browser.wheel([320.0, 240.0], -100.0).await.unwrap();
    assert_same(visit.state().await, turned.wheeled(-100.0));
    visit.settled().await;
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_held_key_flies_along_the_view_for_as_long_as_it_is_held() {
    let (_bench, url) = gateway().await;
    let visit = Visit::to(&url).await;
    visit.settled().await;
    let browser = &visit.browser;
    let listen = "const canvas = document.getElementById('picture');
        window.times = [];
        for (const name of ['keydown', 'keyup'])
            canvas.addEventListener(name, (event) => event.key === 'w' && window.times.push(event.timeStamp));
        canvas.focus()";
    browser.run::<()>(listen, Vec::new()).await.unwrap();
    browser.press('v').await.unwrap();
    let before = visit.state().await;
    browser.key_down('w').await.unwrap();
    tokio::time::sleep(Duration::from_millis(300)).await;
    visit.until(&format!("myriorama.state().target[2] !== {}", before.target[2])).await;
    browser.key_up('w').await.unwrap();
    let after = visit.settled().await;
    let (state, [down, up]) = (visit.state().await, browser.value::<[f64; 2]>("window.times").await.unwrap());
    let moved = state.eye() - before.eye();
    let held_s = (up - down) / 1000.0;
    let flown_s = moved.dot(before.forward()) / (FLIGHT_PER_S * before.size);
    assert!((moved - before.forward() * moved.length()).length() < 1e-9, "sideways: {moved}");
    // A frame may come between the release and its event; one that is late counts for a tenth of a second.
    assert!(flown_s <= held_s + FRAME_S && flown_s > held_s * 0.3, "flown {flown_s} s, held {held_s} s");
    assert_eq!(after.header.number, browser.value::<u64>("myriorama.number()").await.unwrap());
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn arrows_turn_and_signs_come_closer() {
    let (_bench, url) = gateway().await;
    let visit = Visit::to(&url).await;
    visit.settled().await;
    visit.browser.run::<()>("document.getElementById('picture').focus()", Vec::new()).await.unwrap();
    let mut expected = visit.state().await;
    let turns = [(Key::Left, -0.1, 0.0), (Key::Right, 0.1, 0.0), (Key::Up, 0.0, 0.1), (Key::Down, 0.0, -0.1)];
    for (key, by_yaw, by_pitch) in turns {
        visit.browser.press(key).await.unwrap();
        expected = expected.turned(by_yaw, by_pitch);
        assert_same(visit.state().await, expected);
    }
    for (sign, factor) in [('+', 1.15), ('-', 1.0 / 1.15)] {
        visit.browser.press(sign).await.unwrap();
        expected = expected.closer(factor);
        assert_same(visit.state().await, expected);
    }
    visit.browser.press('v').await.unwrap();
    visit.browser.press(Key::Right).await.unwrap();
    let turned = State { is_flying: true, ..expected }.turned(-0.1, 0.0);
    assert_same(visit.state().await, turned);
    assert!(turned.forward().cross(expected.forward()).y > 0.0, "it looks to the right");
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn one_finger_turns_and_two_pan_and_come_closer() {
    let (_bench, url) = gateway().await;
    let visit = Visit::in_view(&url, View { is_touch: true, ..View::default() }).await;
    visit.settled().await;
    let browser = &visit.browser;
    let mut expected = visit.state().await;
    let path = steps([320.0, 240.0], [420.0, 300.0], 4);
    browser.touch(TouchPhase::Start, &path[..1]).await.unwrap();
    for place in &path[1..] {
        browser.touch(TouchPhase::Move, &[*place]).await.unwrap();
    }
    browser.touch(TouchPhase::End, &[]).await.unwrap();
    expected = expected.dragged(path[0], path[4], HEIGHT_PX);
    assert_same(visit.state().await, expected);

    let [mut one, mut other] = [[220.0, 240.0], [420.0, 240.0]];
    browser.touch(TouchPhase::Start, &[one]).await.unwrap();
    browser.touch(TouchPhase::Start, &[one, other]).await.unwrap();
    for by in [[-40.0, 20.0], [-30.0, 10.0]] {
        let next = [one[0] + by[0], one[1] + by[1]];
        browser.touch(TouchPhase::Move, &[next, other]).await.unwrap();
        expected = expected.pinched(other, one, next, HEIGHT_PX);
        one = next;
        let next = [other[0] - by[0], other[1] + by[1]];
        browser.touch(TouchPhase::Move, &[one, next]).await.unwrap();
        expected = expected.pinched(one, other, next, HEIGHT_PX);
        other = next;
    }
    browser.touch(TouchPhase::End, &[]).await.unwrap();
    assert_same(visit.state().await, expected);
    visit.settled().await;
    visit.end(Expected::NoError).await;
}

/// A camera whose closed forms are simple numbers.
const SIMPLE: &str = "{ target: [1, 2, 3], yaw: 0, pitch: 0, distance: 4, fovY: 90, size: 8, isFlying: false }";

#[tokio::test(flavor = "multi_thread")]
async fn the_functions_of_the_camera_have_their_closed_forms() {
    let (_bench, url) = gateway().await;
    let visit = Visit::to(&url).await;
    let forms = [
        ("eyeOf(s)", json!([1.0, 2.0, 7.0])),
        ("eyeOf(turn(s, Math.PI / 2, 0))", json!([5.0, 2.0, 3.0])),
        ("eyeOf(turn({ ...s, isFlying: true }, 1, 0.5))", json!([1.0, 2.0, 7.0])),
        ("[turn(s, 0, 9).pitch, turn(s, 0, -9).pitch]", json!([1.55, -1.55])),
        // 90 degrees at 4 m show 8 m on 400 rows.
        ("pan(s, 100, 50, 400).target", json!([-1.0, 3.0, 3.0])),
        ("[dolly(s, 2).distance, dolly(s, 1e9).distance, dolly(s, 1e-9).distance]", json!([2.0, 8e-4, 400.0])),
        ("dolly({ ...s, isFlying: true }, 2).target", json!([1.0, 2.0, 1.0])),
        ("fly(s, [1, 1, 1], 0.5, false).target", json!([2.0, 3.0, 2.0])),
        ("fly(s, [0, 0, 1], 0.5, true).target", json!([1.0, 2.0, -1.0])),
        ("fit(s, [[0, 0, 0], [2, 4, 4]], 2).target", json!([1.0, 2.0, 2.0])),
        ("[fit(s, [[0, 0, 0], [2, 4, 4]], 2).distance]", json!([3.0 * 2f64.sqrt()])),
        ("eyeOf(pivotAt(s, [2, 3, 1]))", json!([2.0, 3.0, 7.0])),
        ("pivotAt(s, [2, 3, 1]).target", json!([2.0, 3.0, 1.0])),
        ("eyeOf(pivotAt({ ...s, isFlying: true }, [2, 3, 1]))", json!([1.0, 2.0, 7.0])),
        (
            "eyeOf(fromCamera(fromFragment(toFragment(turn(s, 1, 0.5))), 8)).map((v, i) => v - eyeOf(turn(s, 1, 0.5))[i])",
            json!([0.0, 0.0, 0.0]),
        ),
        (
            "[fromFragment('#c=1,2;3,4,5;60'), fromFragment('#c=1,2,3;4,5,6;200'), fromFragment('')].map(Number)",
            json!([0.0, 0.0, 0.0]),
        ),
        (
            "toTransforms(s, 200, 100).frames[0].transform_matrix.flat()",
            json!([1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 2.0, 0.0, 0.0, 1.0, 7.0, 0.0, 0.0, 0.0, 1.0]),
        ),
        ("[toTransforms(s, 200, 100).frames[0].fl_y]", json!([50.0])),
    ];
    for (form, expected) in forms {
        let names =
            "add, dolly, eyeOf, fit, fly, fromCamera, fromFragment, pan, pivotAt, toFragment, toTransforms, turn";
        let body = format!(
            "const {{ {names} }} = await import(new URL('camera.js', document.baseURI)); const s = {SIMPLE}; return {form}"
        );
        let seen: Vec<f64> = visit.browser.run(&body, Vec::new()).await.unwrap();
        let expected: Vec<f64> = serde_json::from_value(expected).unwrap();
        let is_close = seen.len() == expected.len() && seen.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(is_close, "{form} is {seen:?} instead of {expected:?}");
    }
    visit.settled().await;
    visit.end(Expected::NoError).await;
}
