//! A whole plan on one device.

use std::time::Instant;

use depth_image::PinholeCamera;
use planner::{
    Command, Event, Kept, Outcome, Planner, Pricing, Probed, Purpose, RowCosts, Timed, median_costs, shortened_reason,
};

use crate::prober::{ProbeError, Prober};
use crate::subject::{Light, Representation, Viewpoints};

/// Makes a plan from what earlier plans measured; `representations` are those of the ladder's rows, in order. `observe` sees
/// the planner after every measurement. The result has the measurements for later plans.
pub fn plan<P: Pricing>(
    planner: &mut Planner<P>,
    prober: &mut Prober,
    viewpoints: &Viewpoints,
    representations: &[Representation],
    remembered: Kept,
    mut observe: impl FnMut(&Planner<P>),
) -> (Outcome, Kept) {
    let mut kept = remembered.clone();
    let mut commands = planner.step(Event::Remembered(remembered));
    while !commands.is_empty() {
        let mut next = Vec::new();
        for command in commands {
            match command {
                Command::Keep(measured) => kept = *measured,
                Command::Conclude(outcome) => return (*outcome, kept),
                command => {
                    next = answer(prober, viewpoints, representations, command)
                        .map_or_else(Vec::new, |event| planner.step(event));
                    observe(planner);
                }
            }
        }
        commands = next;
    }
    (planner.outcome(), kept)
}

/// Measures what a command asks for; `None` for a command that asks for nothing. A measurement that fails is an answer, too.
pub fn answer(
    prober: &mut Prober,
    viewpoints: &Viewpoints,
    representations: &[Representation],
    command: Command,
) -> Option<Event> {
    let start = Instant::now();
    let (id, measured) = match command {
        Command::Probe { id, row, views, purpose } => {
            let light = if purpose == Purpose::Screening { Light::Screening } else { Light::Session };
            let cameras = viewpoints.cameras(&views);
            let probed = prober.probe(&representations[row], light, &cameras).map(|(errors, costs)| {
                let views = views.into_iter().zip(errors).collect();
                Event::Probed(Probed { id, row, views, costs, busy_s: start.elapsed().as_secs_f64() })
            });
            (id, probed)
        }
        Command::Time { id, rows, view_count, repeats } => {
            let cameras = viewpoints.first(view_count);
            let timed = time(prober, &cameras, representations, &rows, repeats).map(|costs| {
                let rows = rows.into_iter().zip(costs).collect();
                Event::Timed(Timed { id, rows, busy_s: start.elapsed().as_secs_f64() })
            });
            (id, timed)
        }
        Command::Keep(_) | Command::Conclude(_) | Command::Refuse(_) => return None,
    };
    Some(measured.unwrap_or_else(|error| {
        let reason = shortened_reason(&error.to_string());
        Event::Failed { id, reason, busy_s: start.elapsed().as_secs_f64() }
    }))
}

/// The median costs of rows that are timed in turn.
fn time(
    prober: &mut Prober,
    cameras: &[PinholeCamera],
    representations: &[Representation],
    rows: &[usize],
    repeats: usize,
) -> Result<Vec<RowCosts>, ProbeError> {
    let mut costs = vec![Vec::with_capacity(repeats); rows.len()];
    for _ in 0..repeats.max(1) {
        for (&row, costs) in rows.iter().zip(&mut costs) {
            costs.push(prober.time(&representations[row], cameras)?);
        }
    }
    Ok(costs.iter().map(|costs| median_costs(costs)).collect())
}
