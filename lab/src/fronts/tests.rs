//! A front of small views on the software device.

use std::time::Instant;

use depth_image::Antialias;
use engine::GpuEngine;
use glam::UVec2;
use gpu::DevicePreference;
use planner::{Choice, Metric, ProbeView};
use report::{Outcome, Report};

use super::checks::checks;
use super::conditions::{Conditions, read};
use super::measure::{Front, Limits};
use super::report::add_to;
use super::subject::Subject;

fn front(limits: &Limits) -> Front {
    let engine = GpuEngine::shared(DevicePreference::Software).unwrap();
    let blocks = read(None).unwrap().into_iter().find(|subject| subject.name == "blocks").unwrap();
    let subject = Subject::load(&engine, &Conditions { size_px: UVec2::new(64, 48), ..blocks }).unwrap();
    let planning = subject.planning(Antialias::NONE, 0).unwrap();
    Front::measure(&subject, &planning, limits, || ()).unwrap()
}

#[test]
fn a_front_has_all_methods_and_plans_are_near_it() {
    let views = (0..2).map(ProbeView::Screening).collect();
    let front = front(&Limits { end: None, views, only: Some((&[4], &[1.0])) });
    assert_eq!((front.rows.len(), front.left_out), (18, 0));
    let best = front.best(Metric::Flip);
    let falls = |pair: &[&super::row::MeasuredRow]| {
        pair[0].price.node_s <= pair[1].price.node_s
            && pair[0].error_ratio(Metric::Flip) > pair[1].error_ratio(Metric::Flip)
    };
    assert!(!best.is_empty() && best.windows(2).all(falls));
    assert_eq!(front.antialiased.len(), best.len());
    assert_eq!(front.planned.len(), 3);
    for planned in &front.planned {
        let most = planned.budget.error().unwrap().most_ratio();
        assert!(planned.error_ratio <= most, "{}: {}", planned.budget, planned.error_ratio);
        assert!(planned.choice == Choice::Direct || planned.price.node_s < front.direct.node_s);
    }
    assert!(checks(std::slice::from_ref(&front)).iter().all(|check| check.outcome() == Outcome::Holds));
    let mut report = Report::new("fronts", "a device");
    add_to(&mut report, &front).unwrap();
    assert_eq!((report.tables.len(), report.charts.len()), (3, 4));
}

#[test]
fn a_front_ends_in_time_and_counts_what_is_missing() {
    let views = vec![ProbeView::Screening(0)];
    let front = front(&Limits { end: Some(Instant::now()), views, only: None });
    assert_eq!((front.rows.len(), front.left_out, front.planned.len()), (0, 180, 0));
    assert!(checks(&[front]).iter().any(|check| check.outcome() == Outcome::FallsShort));
}
