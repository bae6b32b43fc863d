//! Messages of probes and audits: bad ones are refused with the field's name, good ones come back as they were.

use cluster::limits::MAX_PROBE_VIEWS;
use cluster::{Assignment, BudgetMeasurement, MeasureCosts, Measured, ViewErrors, WorkReport};
use depth_image::{Antialias, ViewPlanes};

use crate::message_tests::{
    assignment, camera, probed_view, read, refusal, session_plan, to_message, work_report, workload,
};
use crate::proto;

#[test]
fn bad_audits_are_refused_by_field() {
    let spoilt = |spoil: &dyn Fn(&mut proto::AuditReport)| {
        let mut message = to_message::<proto::ReportWorkRequest, _>(work_report());
        spoil(message.audit.as_mut().unwrap());
        refusal::<_, WorkReport>(message)
    };
    assert!(spoilt(&|audit| audit.views = vec![audit.views[0]; 65]).contains("audit.views has 65"));
    assert!(spoilt(&|audit| audit.views[0].errors.as_mut().unwrap().flip_ratio = 1.5).contains("flip_ratio is 1.5"));
    assert!(spoilt(&|audit| audit.views[0].errors = None).contains("errors is missing"));
    let order = |spoil: &dyn Fn(&mut proto::AuditOrder)| {
        let mut message = to_message::<proto::Assignment, _>(assignment());
        spoil(message.audit.as_mut().unwrap());
        refusal::<_, Assignment>(message)
    };
    assert!(order(&|order| order.time_ratio = 0.6).contains("audit.time_ratio is 0.6"));
    assert!(order(&|order| order.time_ratio = f64::NAN).contains("audit.time_ratio is NaN"));
    assert!(order(&|order| order.planned_pixel_count = 0).contains("audit.planned_pixel_count is 0"));
    assert!(order(&|order| order.truth_lighting.clear()).contains("audit.truth_lighting"));
}

#[test]
fn probes_survive_the_round_trip_and_impossible_ones_are_refused_by_field() {
    let probe = |views: usize| MeasureCosts {
        workload: workload(),
        method: "joint_carve".to_owned(),
        codec: "lz4".to_owned(),
        typical_views: vec![camera(); views],
        batch_count: 1,
        planes: ViewPlanes { antialias: Antialias::MOST, ..ViewPlanes::COLOR },
        in_background: true,
        budget: Some(BudgetMeasurement { truth_lighting: "phong".to_owned() }),
    };
    let sent = |probe: MeasureCosts| read::<MeasureCosts, _>(to_message::<proto::MeasureCostsRequest, _>(probe));
    assert_eq!(sent(probe(1)), Ok(probe(1)));
    assert_eq!(sent(probe(MAX_PROBE_VIEWS)), Ok(probe(MAX_PROBE_VIEWS)));
    let lightless = MeasureCosts { budget: Some(BudgetMeasurement { truth_lighting: String::new() }), ..probe(1) };
    assert!(sent(lightless).unwrap_err().to_string().contains("truth_lighting"));
    for views in [0, MAX_PROBE_VIEWS + 1] {
        assert!(sent(probe(views)).unwrap_err().to_string().contains("views"));
    }
    let view = probed_view();
    let costs = session_plan().costs;
    let answer = |view| Measured { costs, views: vec![view; 2], busy_s: 0.2, ..Measured::default() };
    let answered = |answer| read::<Measured, _>(to_message::<proto::MeasureCostsResponse, _>(answer));
    assert_eq!(answered(answer(view)), Ok(answer(view)));
    for flip in [f64::NAN, -0.1, 1.1] {
        assert!(answered(answer(ViewErrors { flip, ..view })).unwrap_err().to_string().contains("flip_ratio"));
    }
    let mean_square = f64::INFINITY;
    let refused = answered(answer(ViewErrors { mean_square, ..view })).unwrap_err();
    assert!(refused.to_string().contains("mean_square_ratio"));
}
