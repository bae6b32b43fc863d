//! A plan on the device: what is promised holds on views that the plan never saw.

use engine::GpuEngine;
use glam::UVec2;
use gpu::DevicePreference;
use report::Report;

use super::held_out::held_out;
use super::report::{add_plans, add_scene};
use super::table::{Stage, Subject};

#[test]
fn plans_keep_their_budgets_in_small_views_and_are_reported() {
    let engine = GpuEngine::shared(DevicePreference::Software).unwrap();
    let lighting = "soft 4, occlusion 4".parse().unwrap();
    let stage = Stage::new(&engine, Subject { scene: "blocks", lighting, size_px: UVec2::new(96, 54) }).unwrap();
    let mut steps = 0;
    let table = stage.table(|| steps += 1).unwrap();
    assert_eq!(
        (steps, table.last().unwrap().errors.iter().all(|view| view.flip == 0.0)),
        (Stage::steps(table.len()), true)
    );
    let plans = held_out(&stage, &table, 3, 2).unwrap();
    for plan in &plans {
        // The views of a test and of the table differ by chance.
        assert!(plan.chosen.is_some() && plan.error_over_budget < 1.2 && plan.price_ratio.is_finite(), "{plan:?}");
    }
    let mut report = Report::new("planner", "a device");
    add_scene(&mut report, "blocks", &table).unwrap();
    add_plans(&mut report, &plans).unwrap();
    assert_eq!((report.tables.len(), report.charts.len(), report.checks.len()), (2, 1, 3));
}
