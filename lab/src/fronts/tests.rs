//! A front of small views on the software device.

use depth_image::Antialias;
use engine::GpuEngine;
use glam::UVec2;
use gpu::DevicePreference;
use planner::{Choice, Metric};
use report::{Outcome, Report};

use super::checks::checks;
use super::measure::{Extent, Front};
use super::report::add_to;
use super::subject::{Conditions, Subject};

fn front() -> Front {
    let engine = GpuEngine::shared(DevicePreference::Software).unwrap();
    let conditions = Conditions { size_px: UVec2::new(64, 48), ..Conditions::of_scene("blocks") };
    let subject = Subject::load(&engine, &conditions).unwrap();
    let planning = subject.planning(Antialias::NONE).unwrap();
    Front::measure(&subject, &planning, &Extent::of_four_cameras(2), || ()).unwrap()
}

#[test]
fn a_front_has_all_methods_and_plans_are_near_it() {
    let mut front = front();
    assert_eq!(front.rows.len(), 18);
    assert!(front.rows.iter().all(|row| row.error_ratio(Metric::Flip) > 0.0));
    assert_eq!(front.planned.len(), 3);
    for planned in &front.planned {
        let most = planned.budget.error().unwrap().most_ratio();
        assert!(planned.error_ratio <= most, "{}: {}", planned.budget, planned.error_ratio);
        assert!(planned.choice == Choice::Direct || planned.price.node_s < front.direct.node_s);
    }
    assert!(checks(std::slice::from_ref(&front)).iter().all(|check| check.outcome() == Outcome::Holds));
    let mut report = Report::new("fronts", "a device");
    add_to(&mut report, &front).unwrap();
    assert_eq!((report.tables.len(), report.charts.len()), (2, 4));
    front.rows.truncate(1);
    assert!(checks(&[front]).iter().any(|check| check.outcome() == Outcome::FallsShort));
}
