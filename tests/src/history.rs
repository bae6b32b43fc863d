//! The history of a test, as a client saw it and as coordinators recorded it, and the invariants that hold under all
//! faults.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::io::Cursor;
use std::path::Path;
use std::time::{Duration, Instant};

use cluster::{Assignment, Policy};
use coordinator::schedule::{Command, replay};

/// A received frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// The client's frame number.
    pub frame: u64,
    /// Epoch of the plan that made it.
    pub plan_epoch: u64,
    /// The sample set that it shows.
    pub set_index: u64,
    /// The fault of its picture, if any.
    pub fault: Option<String>,
}

/// Views of one request.
#[derive(Debug, Clone, PartialEq)]
pub struct Call {
    /// Time of the request.
    pub asked: Instant,
    /// Time of the last frame, or of the error.
    pub ended: Instant,
    /// The requested frame numbers.
    pub wanted: std::ops::Range<u64>,
    /// The requested sample set.
    pub set_index: u64,
    /// The received frames.
    pub frames: Vec<Seen>,
    /// The reason for missing frames.
    pub error: Option<String>,
}

/// The history of one cluster.
#[derive(Debug, Clone, Default)]
pub struct History {
    /// The calls of one client, in order.
    pub calls: Vec<Call>,
    /// The plans that the client received.
    pub plans: Vec<Assignment>,
    /// The coordinators' event logs, the first one's first.
    pub logs: Vec<Vec<u8>>,
}

impl History {
    /// Adds a coordinator's log.
    ///
    /// # Errors
    /// The log cannot be read.
    pub fn add_log(&mut self, path: &Path) -> std::io::Result<()> {
        self.logs.push(std::fs::read(path)?);
        Ok(())
    }

    /// The complete frames.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.calls.iter().map(|call| call.frames.len()).sum()
    }

    /// The longest time after `since` without a complete answer.
    #[must_use]
    pub fn longest_wait(&self, since: Instant) -> Duration {
        let answered = self.calls.iter().filter(|call| call.error.is_none() && call.ended > since);
        let mut last = since;
        let mut longest = Duration::ZERO;
        for call in answered {
            longest = longest.max(call.ended - last);
            last = call.ended;
        }
        longest
    }

    /// Describes every violated invariant. A history without frames violates one too.
    #[must_use]
    pub fn violations(&self) -> Vec<String> {
        let mut wrong = Vec::new();
        if self.frames() == 0 {
            wrong.push("no frame came".to_owned());
        }
        wrong.extend(self.lost());
        wrong.extend(self.numbers());
        wrong.extend(self.pictures());
        wrong.extend(self.epochs_of_frames());
        let commanded = self.commanded().unwrap_or_else(|why| {
            wrong.push(why);
            Vec::new()
        });
        wrong.extend(commanded.iter().flat_map(roles));
        wrong.extend(rising(&commanded));
        wrong.extend(self.leaders(&commanded));
        wrong
    }

    /// Every requested frame arrived.
    fn lost(&self) -> Vec<String> {
        let lost =
            self.calls.iter().filter(|call| call.error.is_some() || call.frames.len() != call.wanted.clone().count());
        lost.map(|call| format!("of frames {:?} {} came: {:?}", call.wanted, call.frames.len(), call.error)).collect()
    }

    /// Each frame number arrived once, in the order of the calls, and was requested.
    fn numbers(&self) -> Vec<String> {
        let mut wrong = Vec::new();
        let mut seen = HashSet::new();
        let mut highest = None;
        for call in &self.calls {
            for Seen { frame, .. } in &call.frames {
                if !seen.insert(*frame)
                    || !call.wanted.contains(frame)
                    || highest.is_some_and(|highest| *frame <= highest)
                {
                    wrong.push(format!("frame {frame} came twice, too late or without being asked for"));
                }
            }
            highest = call.frames.iter().map(|seen| seen.frame).max().max(highest);
        }
        wrong
    }

    /// A picture shows one sample set, the requested one.
    fn pictures(&self) -> Vec<String> {
        let frames = self.calls.iter().flat_map(|call| call.frames.iter().map(move |seen| (call, seen)));
        let wrong = |(call, seen): (&Call, &Seen)| {
            let other = (seen.set_index != call.set_index)
                .then(|| format!("frame {} shows set {} for {}", seen.frame, seen.set_index, call.set_index));
            other.or_else(|| seen.fault.clone())
        };
        frames.filter_map(wrong).collect()
    }

    /// Plan epochs of frames rise from call to call: no frame comes from a replaced plan.
    fn epochs_of_frames(&self) -> Vec<String> {
        let epochs = |call: &Call| call.frames.iter().map(|seen| seen.plan_epoch).collect::<BTreeSet<_>>();
        let mut wrong = Vec::new();
        let mut highest = 0;
        for call in &self.calls {
            let epochs = epochs(call);
            if epochs.first().is_some_and(|&least| least < highest) {
                wrong.push(format!("frames {:?} are of plans {epochs:?}, after plan {highest}", call.wanted));
            }
            highest = epochs.last().copied().unwrap_or(0).max(highest);
        }
        wrong
    }

    /// The plans of all logs, in their order. Every replay of a log gives the same commands.
    fn commanded(&self) -> Result<Vec<Assignment>, String> {
        let mut plans = Vec::new();
        for log in &self.logs {
            let [once, again] = [(); 2].map(|()| replay(Cursor::new(log)).map_err(|error| error.to_string()));
            let once = once?;
            let again = again?;
            if once != again {
                return Err("a log is not replayed twice alike".to_owned());
            }
            plans.extend(once.into_iter().flat_map(|step| step.commands).filter_map(plan_of));
        }
        Ok(plans)
    }

    /// An epoch has one plan: the client and the coordinators have the recorded one.
    fn leaders(&self, commanded: &[Assignment]) -> Vec<String> {
        let mut first: BTreeMap<u64, &Assignment> = BTreeMap::new();
        let mut wrong = Vec::new();
        for plan in commanded.iter().chain(&self.plans) {
            if first.entry(plan.plan_epoch).or_insert(plan) != &plan {
                wrong.push(format!("there are two plans {}", plan.plan_epoch));
            }
        }
        let unknown = |plan: &&Assignment| commanded.iter().all(|other| other.plan_epoch != plan.plan_epoch);
        if !self.logs.is_empty() {
            wrong.extend(self.plans.iter().filter(unknown).map(|plan| format!("no log has plan {}", plan.plan_epoch)));
        }
        wrong
    }
}

fn plan_of(command: Command) -> Option<Assignment> {
    match command {
        Command::Apply { plan, .. } => Some(plan.assignment),
        _ => None,
    }
}

/// A view has one compositor; an image, or its tile, has one sampler.
fn roles(plan: &Assignment) -> Vec<String> {
    let names: Vec<_> = plan.compositors.iter().map(|share| &share.node_name).collect();
    let addresses: HashSet<_> = plan.compositors.iter().map(|share| &share.address).collect();
    let mut wrong = Vec::new();
    if addresses.len() < names.len() || names.iter().collect::<HashSet<_>>().len() < names.len() {
        wrong.push(format!("plan {} has a compositor twice: {names:?}", plan.plan_epoch));
    }
    let images: Vec<u32> = plan.samplers.iter().flat_map(|share| share.image_indices.iter().copied()).collect();
    let once = images.iter().collect::<HashSet<_>>().len() == images.len();
    let all = plan.policy == Policy::Direct || images.len() == plan.image_count();
    if !(once && all) {
        wrong.push(format!("plan {} samples images {images:?}", plan.plan_epoch));
    }
    wrong
}

/// Epochs rise from plan to plan of each workload.
fn rising(commanded: &[Assignment]) -> Vec<String> {
    let mut wrong = Vec::new();
    let mut last = BTreeMap::new();
    for Assignment { workload_number, plan_epoch, .. } in commanded {
        // Later sessions receive the same plan again.
        if let Some(before) = last.insert(workload_number, plan_epoch).filter(|before| *before > plan_epoch) {
            wrong.push(format!("plan {plan_epoch} after plan {before} of workload {workload_number}"));
        }
    }
    wrong
}

#[cfg(test)]
#[path = "history_tests.rs"]
mod tests;
