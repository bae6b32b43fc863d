//! The order in which work goes to the device: by class, and within a class by the time that each flow has had. It reads no
//! clock.

use depth_image::{Turn, WorkClass};

/// The share of the time of higher classes that a lower class gets while it waits.
const LOWER_SHARE: f64 = 0.05;
/// The most that a class owes after slices that took longer than predicted.
const MOST_DEBT_S: f64 = 1.0;
/// Sums of times are rounded.
const ROUNDING_S: f64 = 1e-9;
/// The flows of a class that are remembered.
const MOST_FLOWS: usize = 256;

/// Work that waits, class by class.
#[derive(Debug, Default)]
pub(crate) struct FairOrder {
    classes: [ClassOrder; WorkClass::COUNT],
    running: Option<Running>,
}

/// Start-time fair queueing (Goyal, Vin and Cheng 1996): the flow whose last work was to end first goes first.
#[derive(Debug, Default)]
struct ClassOrder {
    /// By arrival.
    waiting: Vec<Waiting>,
    flows: Vec<Flow>,
    /// The flow whose work is on the device: it is remembered, for it is yet to be charged.
    running: Option<u64>,
    /// The start of the work that went last, on the clock of the flows.
    virtual_s: f64,
    /// Device time that the class may take before higher classes.
    credit_s: f64,
}

#[derive(Debug, Clone, Copy)]
struct Waiting {
    ticket: u64,
    flow: u64,
    predicted_s: f64,
}

/// A flow, and the end of its last work on the clock of the flows.
#[derive(Debug, Clone, Copy)]
struct Flow {
    id: u64,
    end_s: f64,
}

#[derive(Debug, Clone, Copy)]
struct Running {
    turn: Turn,
    /// It went before waiting work of a higher class.
    by_credit: bool,
}

impl FairOrder {
    /// Adds work that waits.
    pub fn enter(&mut self, ticket: u64, turn: Turn, predicted_s: f64) {
        self.classes[turn.class as usize].enter(Waiting { ticket, flow: turn.flow, predicted_s });
    }

    /// Removes the work that goes now. The device is free; [`FairOrder::used`] says when it is so again.
    pub fn next(&mut self) -> Option<u64> {
        let highest = self.classes.iter().position(|class| !class.waiting.is_empty())?;
        let with_credit = (highest + 1..WorkClass::COUNT).rev().find(|&lower| self.classes[lower].has_credit());
        let number = with_credit.unwrap_or(highest);
        let gone = self.classes[number].take()?;
        let class = [WorkClass::Live, WorkClass::Batch, WorkClass::Background][number];
        let turn = Turn { class, flow: gone.flow };
        self.running = Some(Running { turn, by_credit: with_credit.is_some() });
        Some(gone.ticket)
    }

    /// Charges the work that went last with the time that it took.
    pub fn used(&mut self, seconds: f64) {
        let Some(Running { turn, by_credit }) = self.running.take() else { return };
        let (higher, lower) = self.classes.split_at_mut(turn.class as usize + 1);
        for class in lower.iter_mut().filter(|class| !class.waiting.is_empty()) {
            class.credit_s += LOWER_SHARE * seconds;
        }
        higher[turn.class as usize].charge(turn.flow, seconds, by_credit);
    }
}

impl ClassOrder {
    fn enter(&mut self, work: Waiting) {
        let is_waiting = self.waiting.iter().any(|other| other.flow == work.flow);
        match self.flows.iter_mut().find(|flow| flow.id == work.flow) {
            Some(_) if is_waiting => (),
            // An idle flow banks nothing.
            Some(flow) => flow.end_s = flow.end_s.max(self.virtual_s),
            None => self.flows.push(Flow { id: work.flow, end_s: self.virtual_s }),
        }
        self.waiting.push(work);
        self.forget();
    }

    /// The place of the work that goes first, and where it starts on the clock of the flows.
    fn first(&self) -> Option<(usize, f64)> {
        let flows = self.waiting.iter().map(|work| self.flows.iter().find(|flow| flow.id == work.flow));
        let starts = flows.map(|flow| flow.map_or(self.virtual_s, |flow| flow.end_s));
        starts.enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b))
    }

    fn has_credit(&self) -> bool {
        self.first().is_some_and(|(place, _)| self.credit_s + ROUNDING_S >= self.waiting[place].predicted_s)
    }

    fn take(&mut self) -> Option<Waiting> {
        let (place, start_s) = self.first()?;
        self.virtual_s = self.virtual_s.max(start_s);
        let gone = self.waiting.remove(place);
        self.running = Some(gone.flow);
        Some(gone)
    }

    fn charge(&mut self, flow: u64, seconds: f64, by_credit: bool) {
        self.running = None;
        if let Some(flow) = self.flows.iter_mut().find(|other| other.id == flow) {
            flow.end_s += seconds;
        }
        // Credit is for times without a turn of one's own.
        self.credit_s = if by_credit { self.credit_s - seconds } else { self.credit_s.min(0.0) }.max(-MOST_DEBT_S);
        if self.waiting.is_empty() {
            *self = Self { credit_s: self.credit_s.min(0.0), ..Self::default() };
        }
        self.forget();
    }

    /// Forgets flows that are as new ones, then those that are nearest to it.
    fn forget(&mut self) {
        let Self { waiting, flows, virtual_s, running, .. } = self;
        let has_work = |flow: &Flow| *running == Some(flow.id) || waiting.iter().any(|work| work.flow == flow.id);
        flows.retain(|flow| flow.end_s > *virtual_s || has_work(flow));
        while flows.len() > MOST_FLOWS {
            let idle = flows.iter().enumerate().filter(|(_, flow)| !has_work(flow));
            let Some((least, _)) = idle.min_by(|(_, a), (_, b)| a.end_s.total_cmp(&b.end_s)) else { return };
            flows.swap_remove(least);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use WorkClass::{Background, Batch, Live};

    /// Flows that always have work of a length, and the time that each had after so many slices.
    fn shares(flows: &[(Turn, f64)], slices: usize) -> Vec<f64> {
        let mut order = FairOrder::default();
        let mut had_s = vec![0.0; flows.len()];
        for (ticket, &(turn, slice_s)) in (0..).zip(flows) {
            order.enter(ticket, turn, slice_s);
        }
        for _ in 0..slices {
            let ticket = order.next().expect("work waits");
            let (turn, slice_s) = flows[ticket as usize];
            // A greedy flow asks for its next slice before this one ends.
            order.enter(ticket, turn, slice_s);
            order.used(slice_s);
            had_s[ticket as usize] += slice_s;
        }
        had_s
    }

    fn turn(class: WorkClass, flow: u64) -> Turn {
        Turn { class, flow }
    }

    #[test]
    fn flows_of_a_class_have_equal_time_whatever_their_slices() {
        let had_s = shares(&[(turn(Batch, 1), 1.0), (turn(Batch, 2), 4.0), (turn(Batch, 3), 0.5)], 700);
        let longest = 4.0;
        for pair in had_s.windows(2) {
            assert!((pair[0] - pair[1]).abs() <= 2.0 * longest, "{had_s:?}");
        }
        assert!(had_s[0] > 20.0 * longest, "{had_s:?}");
    }

    #[test]
    fn a_slice_is_charged_to_its_flow_whoever_arrives_while_it_runs() {
        let mut order = FairOrder::default();
        let slices_s = [1.0, 0.1];
        let mut had_s = [0.0; 2];
        (0..2).for_each(|flow| order.enter(flow, turn(Batch, flow), slices_s[flow as usize]));
        for visitor in 2..1000 {
            let flow = order.next().expect("work waits");
            if flow < 2 {
                order.enter(visitor, turn(Batch, visitor), 0.01);
            }
            let slice_s = slices_s.get(flow as usize).copied().unwrap_or(0.01);
            order.used(slice_s);
            if flow < 2 {
                // The next slice of the same work.
                had_s[flow as usize] += slice_s;
                order.enter(flow, turn(Batch, flow), slice_s);
            }
        }
        assert!((had_s[0] - had_s[1]).abs() <= 2.0 && had_s[0] > 3.0, "{had_s:?}");
    }

    #[test]
    fn a_lower_class_has_five_hundredths_of_the_higher_ones_time() {
        let flows = [(turn(Live, 1), 0.05), (turn(Batch, 2), 0.05), (turn(Background, 3), 0.05)];
        let [live_s, batch_s, background_s] = *shares(&flows, 10_000) else { unreachable!() };
        assert!((batch_s / live_s - 0.05).abs() < 1e-3, "{batch_s} of {live_s}");
        assert!((background_s / (live_s + batch_s) - 0.05).abs() < 1e-3, "{background_s}");
    }

    #[test]
    fn a_slice_larger_than_any_of_the_higher_class_is_not_starved() {
        let [live_s, batch_s] = *shares(&[(turn(Live, 1), 0.01), (turn(Batch, 2), 3.0)], 20_000) else {
            unreachable!()
        };
        assert!(batch_s >= 6.0 && batch_s / live_s < 0.06, "{batch_s} of {live_s}");
    }

    #[test]
    fn the_highest_class_that_waits_goes_first_and_waiting_alone_is_no_credit() {
        let mut order = FairOrder::default();
        order.enter(1, turn(Background, 1), 1.0);
        order.enter(2, turn(Batch, 2), 1.0);
        order.enter(3, turn(Live, 3), 1.0);
        let tickets: Vec<_> = std::iter::from_fn(|| {
            let ticket = order.next();
            order.used(1.0);
            ticket
        })
        .collect();
        assert_eq!(tickets, [3, 2, 1]);
    }

    #[test]
    fn a_new_flow_goes_next_and_catches_nothing_up() {
        let mut order = FairOrder::default();
        order.enter(0, turn(Batch, 1), 1.0);
        let mut served = Vec::new();
        for slice in 1..=40 {
            let ticket = order.next().expect("work waits");
            served.push(ticket);
            if slice == 20 {
                order.enter(100, turn(Batch, 2), 1.0);
            }
            let flow = if ticket >= 100 { 2 } else { 1 };
            order.enter(ticket + 1, turn(Batch, flow), 1.0);
            order.used(1.0);
        }
        let of_new = |served: &[u64]| served.iter().filter(|&&ticket| ticket >= 100).count();
        assert_eq!(of_new(&served[..20]), 0);
        assert!(served[20] >= 100, "{served:?}");
        assert_eq!(of_new(&served[20..]), 10, "{served:?}");
    }

    #[test]
    fn flows_by_the_thousand_leave_no_more_than_the_bound() {
        let mut order = FairOrder::default();
        order.enter(0, turn(Live, 0), 1.0);
        for flow in 1..10_000 {
            order.enter(flow, turn(Live, flow), 1.0);
            assert!(order.next().is_some());
            order.used(1.0);
            assert!(order.classes[0].flows.len() <= MOST_FLOWS + 2, "{}", order.classes[0].flows.len());
        }
        while order.next().is_some() {
            order.used(1.0);
        }
        assert!(order.classes[0].flows.is_empty(), "an idle class remembers nobody");
    }

    #[test]
    fn a_slice_that_was_far_too_long_is_forgiven_in_the_end() {
        let mut order = FairOrder::default();
        order.enter(0, turn(Live, 0), 0.05);
        order.enter(1, turn(Batch, 1), 0.05);
        let mut until_batch = 0;
        for ticket in 2.. {
            let gone = order.next().expect("work waits");
            if gone == 1 {
                break;
            }
            until_batch += 1;
            order.enter(ticket, turn(Live, 0), 0.05);
            order.used(0.05);
        }
        assert_eq!(until_batch, 20);
        order.enter(1, turn(Batch, 1), 0.05);
        order.used(1000.0);
        let again = (10_000..).take_while(|&ticket| {
            let gone = order.next().expect("work waits");
            order.enter(ticket, turn(Live, 0), 0.05);
            order.used(0.05);
            gone != 1
        });
        assert_eq!(again.count(), 420, "a second and a slice, at five hundredths");
    }
}
