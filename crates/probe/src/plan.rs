//! A whole plan on one device.

use std::time::Instant;

use planner::{Command, Event, Kept, Outcome, Planner, Pricing, ProbeId, Probed, Purpose, Timed};

use crate::prober::{ProbeError, Prober};
use crate::representation::Representation;
use crate::subject::Light;

/// The longest reason of a failure that a planner takes, in bytes.
const MAX_REASON_BYTES: usize = 1024;

/// Makes a plan from what earlier plans measured; `representations` are those of the ladder's rows, in order. `observe` sees
/// the planner after every measurement. The result has the measurements for later plans.
pub fn plan<P: Pricing>(
    planner: &mut Planner<P>,
    prober: &mut Prober<'_>,
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
                    next = answer(prober, representations, command).map_or_else(Vec::new, |event| planner.step(event));
                    observe(planner);
                }
            }
        }
        commands = next;
    }
    (planner.outcome(), kept)
}

/// Measures what a command asks for; `None` for a command that asks for nothing. A measurement that fails is an answer, too.
pub fn answer(prober: &mut Prober<'_>, representations: &[Representation], command: Command) -> Option<Event> {
    let start = Instant::now();
    let (id, measured) = match command {
        Command::Probe { id, row, views, purpose } => {
            let light = if purpose == Purpose::Screening { Light::Screening } else { Light::Session };
            let probed = prober.probe(&representations[row], light, &views).map(|(errors, costs)| {
                let views = views.into_iter().zip(errors).collect();
                Event::Probed(Probed { id, row, views, costs, busy_s: start.elapsed().as_secs_f64() })
            });
            (id, probed)
        }
        Command::Time { id, rows, view_count, repeats } => {
            let all: Vec<Representation> = rows.iter().map(|&row| representations[row].clone()).collect();
            let timed = prober.time(&all, view_count, repeats).map(|costs| {
                let rows = rows.into_iter().zip(costs).collect();
                Event::Timed(Timed { id, rows, busy_s: start.elapsed().as_secs_f64() })
            });
            (id, timed)
        }
        Command::Keep(_) | Command::Conclude(_) | Command::Refuse(_) => return None,
    };
    Some(measured.unwrap_or_else(|error| failed(id, &error, start.elapsed().as_secs_f64())))
}

fn failed(id: ProbeId, error: &ProbeError, busy_s: f64) -> Event {
    let mut reason = error.to_string();
    reason.truncate(reason.floor_char_boundary(MAX_REASON_BYTES));
    Event::Failed { id, reason, busy_s }
}
