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

    step(&mut scheduler, Event::Closed { session: 1 });
    assert_eq!(contents(&scheduler)[0], alone[0], "session 2 still looks from there");
    step(&mut scheduler, Event::Closed { session: 2 });
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
    // Seven views on each circle; each circle is twice as far away as the one before.
    let at = |circle: usize, azimuth: usize| {
        let mut view = view(0.5 * azimuth as f32);
        view.eye_in_world *= 2f32.powi(circle as i32);
        view
    };
    let spread = |circles: usize| (0..7 * circles).map(|i| at(i / 7, i % 7)).collect::<Vec<_>>();
    let mut scheduler = of(3);
    let refused = step(&mut scheduler, looking_from(1, spread(12)));
    assert!(matches!(&refused[..], [Command::Refuse { error: ChoiceError::Cells { cells: 84 }, .. }]), "{refused:?}");
    step(&mut scheduler, looking_from(1, spread(4)));
    assert_eq!(cells(&scheduler).len(), 28);
    assert_eq!(scheduler.admits_viewpoints(1, &spread(12)), Err(ChoiceError::Cells { cells: 84 }));
    assert_eq!(scheduler.admits_viewpoints(1, &spread(2)), Ok(()));
    // A log may have the event all the same: the nearest cell serves.
    step(&mut scheduler, Event::ViewpointsChanged { session: 1, viewpoints: spread(12) });
    assert_eq!(cells(&scheduler).len(), MAX_CELLS);

    let mut scheduler = of(3);
    step(&mut scheduler, Event::Opened(Box::new(opening(1, PolicyChoice::Pipeline, 40))));
    assert_eq!(scheduler.admits_viewpoints(1, &spread(1)), Err(ChoiceError::NoCells { session: 1 }));
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
    let (mut plans, mut now) = (Vec::new(), Duration::from_secs(10));
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
