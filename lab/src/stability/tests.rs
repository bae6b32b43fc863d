//! Short paths of small views on the software device.

use std::collections::BTreeSet;
use std::sync::Arc;

use engine::GpuEngine;
use glam::UVec2;
use gpu::DevicePreference;
use report::Report;

use super::figures::Figures;
use super::measure::{Measured, Stand};
use super::paths::{PATHS, Path, PathKind, Switch};
use super::report::add_to;
use super::subject::Subject;

fn kind(switch: Switch) -> PathKind {
    PATHS.into_iter().find(|kind| kind.switch == switch).unwrap()
}

fn blocks(engine: &Arc<GpuEngine>) -> Subject {
    Subject::load(engine, "blocks", "phong", UVec2::new(64, 48)).unwrap()
}

fn engine() -> Arc<GpuEngine> {
    GpuEngine::shared(DevicePreference::Software).unwrap()
}

#[test]
fn frames_of_a_set_follow_one_another_and_paths_switch_as_they_say() {
    let subject = blocks(&engine());
    for kind in PATHS {
        let path = Path::new(kind, &subject, 24).unwrap();
        let switches = (0..24).filter(|&frame| path.is_switch(frame)).count();
        assert_eq!((path.frames.len(), switches + 1), (24, path.sets.len()), "{}", kind.name);
        let expected = match kind.switch {
            Switch::None => 0..=0,
            Switch::Representation => 1..=1,
            Switch::Cell => 1..=8,
            Switch::Moment => 23..=23,
            Switch::Light => 3..=10,
        };
        assert!(expected.contains(&switches), "{}: {switches} switches", kind.name);
        let sets: Vec<usize> = path.frames.iter().map(|frame| frame.set).collect();
        assert!(sets.is_sorted(), "{}: {sets:?}", kind.name);
    }
}

#[test]
fn a_still_path_has_no_error_of_changes_and_a_moving_one_has() {
    let engine = engine();
    let subject = blocks(&engine);
    let stand = Stand { engine: engine.as_ref(), subject: &subject };
    let path = Path::new(kind(Switch::None), &subject, 3).unwrap();
    let still = Path { frames: vec![path.frames[0]; 3], sets: path.sets.clone(), kind: path.kind };
    let still = stand.measure(still).unwrap();
    assert_eq!(still.figures.len(), 2);
    assert!(still.figures.iter().all(|figures| figures.change_error == 0.0 && figures.flip > 0.0));
    let moving = stand.measure(path).unwrap();
    assert_eq!((moving.figures.len(), moving.jump()), (2, None), "nothing switches");
    assert!(moving.figures.iter().all(|figures| figures.change_error > 0.0 && figures.change_error < 0.5));
    let mut report = Report::new("stability", "a device");
    add_to(&mut report, &[still, moving]).unwrap();
    assert_eq!((report.tables.len(), report.charts.len()), (1, 2));
    assert!(report.checks.is_empty(), "neither path has cells");
}

/// The figures are made up.
#[test]
fn a_jump_is_the_worst_switch_over_the_median_of_other_changes() {
    let subject = blocks(&engine());
    let jump = |at_switch: f64| {
        let path = Path::new(kind(Switch::Cell), &subject, 12).unwrap();
        let change_error = |frame: usize| if path.is_switch(frame) { at_switch } else { 0.02 };
        let figures = (1..12).map(|frame| Figures { flip: 0.1, change_error: change_error(frame) }).collect();
        Measured { path, figures }.jump().unwrap()
    };
    assert!((jump(0.02) - 1.0).abs() < 1e-12 && (jump(0.05) - 2.5).abs() < 1e-12);
}

#[test]
fn paths_have_names_of_their_own() {
    let names: BTreeSet<&str> = PATHS.iter().map(|kind| kind.name).collect();
    assert_eq!(names.len(), PATHS.len());
}
