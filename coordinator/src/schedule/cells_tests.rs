//! Sample cameras follow the viewpoints of sessions.

use std::time::Duration;

use cluster::limits::MAX_CELLS;
use cluster::{Assignment, PolicyChoice};
use depth_image::PinholeCamera;

use super::command::Command;
use super::demand::ChoiceError;
use super::event::{Event, Opening};
use super::scheduler::Scheduler;
use super::test_support::{join, opening, view};

fn of(nodes: u64) -> Scheduler {
    let mut scheduler = Scheduler::default();
    (0..nodes).for_each(|i| drop(scheduler.step(Duration::ZERO, join(&format!("n{i}"), i, 0))));
    scheduler
}

fn looking_from(session: u64, viewpoints: Vec<PinholeCamera>) -> Event {
    Event::Opened(Box::new(Opening { viewpoints, ..opening(session, PolicyChoice::Pipeline, 40) }))
}

fn step(scheduler: &mut Scheduler, event: Event) -> Vec<Command> {
    scheduler.step(Duration::from_secs(1), event)
}

fn step_at(scheduler: &mut Scheduler, now_s: u64, event: Event) -> Vec<Command> {
    let mut commands = scheduler.step(Duration::from_secs(now_s), event);
    commands.retain(|command| !matches!(command, Command::Probe(_)));
    commands
}

/// Seven views on each circle; each circle is twice as far away as the one before. Each is a cell of its own.
fn spread(circles: std::ops::Range<usize>) -> Vec<PinholeCamera> {
    let at = |circle: usize, azimuth: usize| {
        let mut view = view(0.5 * azimuth as f32);
        view.eye_in_world *= 2f32.powi(circle as i32);
        view
    };
    circles.flat_map(|circle| (0..7).map(move |azimuth| at(circle, azimuth))).collect()
}

fn seen(scheduler: &Scheduler, node: &str, viewpoints: Vec<PinholeCamera>) -> Event {
    let workload_number = plan(scheduler).workload_number;
    Event::ViewersMoved { workload_number, node_name: node.to_owned(), viewpoints }
}

fn plan(scheduler: &Scheduler) -> Assignment {
    scheduler.status().workloads[0].plan.clone().expect("a plan").assignment
}

fn cells(scheduler: &Scheduler) -> Vec<u32> {
    let workload = plan(scheduler).workload;
    (0..workload.cell_count()).filter_map(|cell| Some(workload.cameras_of_cell(cell)?.len() as u32)).collect()
}

/// The content hash of each cell's set.
fn contents(scheduler: &Scheduler) -> Vec<cluster::SetContent> {
    let plan = plan(scheduler);
    let of_cell = |cell| plan.of_cell(cell).and_then(|plan| plan.set_content(0)).expect("a set");
    (0..plan.workload.cell_count() as u32).map(of_cell).collect()
}

#[test]
fn sessions_near_each_other_share_cells_and_distant_ones_do_not() {
    let mut scheduler = of(4);
    step(&mut scheduler, looking_from(1, vec![view(0.0), view(0.1)]));
    assert_eq!(cells(&scheduler), [2]);
    let alone = contents(&scheduler);
    let commands = step(&mut scheduler, looking_from(2, vec![view(0.05)]));
    assert!(matches!(&commands[..], [Command::Apply { sessions, .. }] if sessions == &[2]), "{commands:?}");
    assert_eq!((plan(&scheduler).plan_epoch, contents(&scheduler)), (1, alone.clone()), "nothing has changed");

    let commands = step(&mut scheduler, looking_from(3, vec![view(3.0)]));
    let [Command::Apply { sessions, plan: told, .. }] = &commands[..] else { panic!("{commands:?}") };
    assert_eq!((&sessions[..], told.assignment.plan_epoch), (&[1, 2, 3][..], 2));
    assert!(told.reason.contains("sessions look from elsewhere"), "{}", told.reason);
    assert_eq!(cells(&scheduler), [2, 1]);
    assert_eq!(contents(&scheduler)[0], alone[0], "the samples of this cell stay valid");
    let workload = plan(&scheduler).workload;
    assert_eq!([0.02, 3.0].map(|azimuth| workload.cell_of(&view(azimuth))), [0, 1]);

    step_at(&mut scheduler, 2, Event::Closed { session: 1 });
    assert_eq!(contents(&scheduler)[0], alone[0], "session 2 still looks from there");
    step_at(&mut scheduler, 2, Event::Closed { session: 2 });
    assert_eq!(cells(&scheduler), [1], "no session does");
}

#[test]
fn a_cell_without_viewpoints_is_removed() {
    let mut scheduler = of(3);
    step(&mut scheduler, looking_from(1, vec![view(0.0)]));
    let before = contents(&scheduler);
    let commands =
        step(&mut scheduler, Event::ViewpointsChanged { session: 1, viewpoints: vec![view(0.0), view(2.0)] });
    assert!(matches!(&commands[..], [Command::Apply { .. }]));
    assert_eq!((cells(&scheduler), contents(&scheduler)[0]), (vec![1, 1], before[0]));
    let gone = Event::ViewpointsChanged { session: 1, viewpoints: vec![view(2.0)] };
    assert_eq!(step(&mut scheduler, gone), [], "within a second of the last change");
    scheduler.step(Duration::from_secs(2), Event::Tick);
    assert_eq!(cells(&scheduler), [1]);
    assert_ne!(contents(&scheduler), before);
    assert_eq!(
        step(&mut scheduler, Event::ViewpointsChanged { session: 77, viewpoints: vec![view(1.0)] }),
        [],
        "an unknown session"
    );
}

#[test]
fn every_image_of_every_cell_has_one_sampler() {
    let mut scheduler = of(5);
    step(&mut scheduler, looking_from(1, (0..30).map(|i| view(0.2 * i as f32)).collect()));
    let plan = plan(&scheduler);
    let workload = &plan.workload;
    assert!(workload.cell_count() > 8 && workload.cell_count() <= MAX_CELLS, "{}", workload.cell_count());
    assert_eq!(workload.validate(), Ok(()));
    let mut images = 0;
    for cell in 0..workload.cell_count() as u32 {
        let of_cell = plan.of_cell(cell).expect("a cell");
        let mut own: Vec<u32> = of_cell.samplers.iter().flat_map(|share| share.image_indices.clone()).collect();
        own.sort_unstable();
        assert_eq!(own, (0..of_cell.image_count() as u32).collect::<Vec<_>>());
        images += of_cell.image_count();
    }
    assert_eq!(images, plan.image_count());
    assert_eq!(plan.of_cell(workload.cell_count() as u32), None);
}

#[test]
fn too_many_cells_are_refused_and_given_sample_cameras_are_kept() {
    let spread = |circles: usize| spread(0..circles);
    let mut scheduler = of(3);
    let refused = step(&mut scheduler, looking_from(1, spread(12)));
    assert!(matches!(&refused[..], [Command::Refuse { error: ChoiceError::Cells { cells: 84 }, .. }]), "{refused:?}");
    step(&mut scheduler, looking_from(1, spread(4)));
    assert_eq!(cells(&scheduler).len(), 28);
    assert_eq!(scheduler.admits(1, 40, None, Some(&spread(12))), Err(ChoiceError::Cells { cells: 84 }));
    assert_eq!(scheduler.admits(1, 40, None, Some(&spread(2))), Ok(()));
    // A log may have the event all the same: the nearest cell serves.
    step(&mut scheduler, Event::ViewpointsChanged { session: 1, viewpoints: spread(12) });
    assert_eq!(cells(&scheduler).len(), MAX_CELLS);

    let mut scheduler = of(3);
    step(&mut scheduler, Event::Opened(Box::new(opening(1, PolicyChoice::Pipeline, 40))));
    assert_eq!(scheduler.admits(1, 40, None, Some(&spread(1))), Err(ChoiceError::NoCells { session: 1 }));
    let commands = step(&mut scheduler, looking_from(2, spread(1)));
    assert!(matches!(&commands[..], [.., Command::Apply { sessions, .. }] if sessions == &[2]), "{commands:?}");
    assert!(scheduler.has_session(1), "beside the other");
}

#[test]
fn cells_follow_live_viewers_and_change_once_a_second_at_most() {
    let mut scheduler = of(4);
    step(&mut scheduler, looking_from(1, vec![view(0.0)]));
    let number = plan(&scheduler).workload_number;
    let seen = |azimuth_rad| Event::ViewersMoved {
        workload_number: number,
        node_name: "n1".to_owned(),
        viewpoints: vec![view(azimuth_rad)],
    };
    let mut plans = Vec::new();
    let mut now = Duration::from_secs(10);
    for tenth in 0..100 {
        now += Duration::from_millis(100);
        let event = if tenth % 3 == 0 { seen(tenth as f32 * 0.06) } else { Event::Tick };
        let commands = scheduler.step(now, event);
        plans.extend(commands.iter().filter(|command| matches!(command, Command::Apply { .. })).map(|_| now));
    }
    assert!(plans.len() >= 3, "the viewer has gone all around: {plans:?}");
    assert!(plans.windows(2).all(|pair| pair[1] - pair[0] >= Duration::from_secs(1)), "{plans:?}");
    assert_eq!(cells(&scheduler).len(), 2, "the session's own cell, and the viewer's");
    scheduler.step(now, Event::Left { incarnation: 1, node_name: "n1".to_owned() });
    scheduler.step(now + Duration::from_secs(2), Event::ViewpointsChanged { session: 1, viewpoints: vec![view(0.0)] });
    assert_eq!(cells(&scheduler).len(), 1, "viewers of a lost node are forgotten");
}

#[test]
fn sessions_that_come_and_go_change_cells_once_a_second_at_most() {
    let mut scheduler = of(4);
    step(&mut scheduler, looking_from(1, vec![view(0.0)]));
    let mut plans = Vec::new();
    let mut now = Duration::from_secs(2);
    for i in 0..100 {
        now += Duration::from_millis(50);
        let session = 2 + i / 2;
        let event = match i % 2 {
            0 => looking_from(session, vec![view(1.0 + 0.5 * (session % 7) as f32)]),
            _ => Event::Closed { session },
        };
        let mut commands = scheduler.step(now, event);
        commands.extend(scheduler.step(now, Event::Tick));
        let is_change = |command: &Command| matches!(command, Command::Apply { plan, .. } if plan.assignment.plan_epoch > plans.len() as u64 + 1);
        let changes = commands.iter().filter(|command| is_change(command)).count();
        assert!(changes <= 1, "{commands:?}");
        plans.extend((changes > 0).then_some(now));
    }
    assert!(plans.len() >= 3, "{plans:?}");
    assert!(plans.windows(2).all(|pair| pair[1] - pair[0] >= Duration::from_secs(1)), "{plans:?}");
}

#[test]
fn cells_of_live_viewers_leave_room_for_declared_viewpoints() {
    let mut scheduler = of(4);
    step(&mut scheduler, looking_from(1, spread(0..2)));
    let live = seen(&scheduler, "n1", spread(3..13));
    step_at(&mut scheduler, 3, live);
    assert_eq!(cells(&scheduler).len(), MAX_CELLS);
    assert_eq!(scheduler.admits(1, 40, None, Some(&spread(0..3))), Ok(()), "live viewers promise nothing");
    step_at(&mut scheduler, 5, looking_from(2, spread(13..17)));
    assert_eq!(cells(&scheduler).len(), MAX_CELLS);
    let workload = plan(&scheduler).workload;
    let own: std::collections::BTreeSet<u32> =
        spread(0..2).iter().chain(&spread(13..17)).map(|view| workload.cell_of(view)).collect();
    assert_eq!(own.len(), 42, "each declared viewpoint has its cell");
}

#[test]
fn viewpoints_that_take_more_than_is_left_beside_promises_are_refused() {
    let timeline = cluster::Timeline { start_s: 0.0, step_s: 1.0, set_count: 1000 };
    let of_cells = |session, frames_per_s| {
        let mut opening =
            Opening { viewpoints: vec![view(0.0)], frames_per_s, ..opening(session, PolicyChoice::Pipeline, 1) };
        opening.workload.timeline = timeline;
        opening
    };
    let mut scheduler = of(4);
    step(&mut scheduler, Event::Opened(Box::new(of_cells(1, Some(20.0)))));
    assert_eq!(scheduler.admits(1, 1, Some(20.0), Some(&spread(0..1))), Ok(()));
    let refused = scheduler.admits(1, 1, Some(20.0), Some(&spread(0..9)));
    assert!(matches!(refused, Err(ChoiceError::Overload { needed }) if needed > 1.0), "{refused:?}");
    let mut scheduler = of(4);
    step(&mut scheduler, Event::Opened(Box::new(of_cells(1, None))));
    assert_eq!(scheduler.admits(1, 1, None, Some(&spread(0..9))), Ok(()), "a batch takes what is left");
    let both = scheduler.admits(1, 1, Some(20.0), Some(&spread(0..9)));
    assert!(matches!(both, Err(ChoiceError::Overload { .. })), "rate and viewpoints together: {both:?}");
    assert_eq!(scheduler.admits(1, 1, Some(20.0), Some(&spread(0..1))), Ok(()));
}
