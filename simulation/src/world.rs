//! The event loop that executes a plan.
//!
//! Requests take no time. A share of images occupies the sender's link while it is sent, and the receiver's link from its
//! arrival on. Parcels on a link wait for those before. Frames leave over the compositor's link; clients are many, and
//! each has a link of its own.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use client::ViewQueue;
use cluster::{Assignment, Policy, SessionPlan};

use crate::cluster::{Cluster, Habits, Machine, Transfer};
use crate::distribution::{compositors_of, receivers};
use crate::node::{Job, Node, Parcel, Sampled};
use crate::planning::number_of;
use crate::run::Run;

/// The parcels that a batch's frames leave in: a client requests more before it has received all of them.
const PARCELS: usize = 8;

/// A future event; of several at the same time, the one that was scheduled first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Event {
    /// A device has ended its job.
    Done { node: usize },
    /// A link has sent its parcel.
    Sent { node: usize },
    /// A sampler's images are there: their place in its list of receivers.
    Arrived { sampler: usize, set: u32, place: usize, node: usize },
}

struct World<'a> {
    cluster: &'a Cluster,
    plan: &'a Assignment,
    habits: Habits,
    sets: u32,
    nodes: Vec<Node>,
    /// Views that no compositor has been asked for.
    unrequested: ViewQueue<()>,
    /// Nodes that make views, in the order of their places.
    compositors: Vec<usize>,
    /// The receivers of each node's images under a relay; none for nodes that do not sample.
    receivers: Vec<Vec<usize>>,
    now_s: f64,
    scheduled: BinaryHeap<Reverse<(u64, u64, Event)>>,
    events: u64,
    /// Views of each set that are still to be delivered, and when the last was.
    due: Vec<(usize, f64)>,
}

/// Executes a plan for `sets` sets of `views` views.
#[must_use]
pub fn run(cluster: &Cluster, plan: &SessionPlan, views: usize, sets: u32, habits: Habits) -> Run {
    let mut world = World::new(cluster, plan, views, sets, habits);
    world.begin();
    while let Some(Reverse((at, _, event))) = world.scheduled.pop() {
        world.now_s = f64::from_bits(at);
        match event {
            Event::Done { node } => world.done(node),
            Event::Sent { node } => world.sent(node),
            Event::Arrived { sampler, set, place, node } => {
                world.relay(node, sampler, set, Some(place));
                world.images_arrived(node, set);
            }
        }
    }
    Run {
        complete_s: world.due.iter().map(|(due, last_s)| if *due == 0 { *last_s } else { f64::NAN }).collect(),
        busy: world.nodes.iter().map(|node| node.busy).collect(),
    }
}

impl<'a> World<'a> {
    fn new(cluster: &'a Cluster, plan: &'a SessionPlan, views: usize, sets: u32, habits: Habits) -> Self {
        let view_s = plan.view_s();
        let plan = &plan.assignment;
        let weighted = compositors_of(plan, views);
        let weights: Vec<u32> = weighted.iter().map(|(_, weight)| *weight).collect();
        let mut unrequested = ViewQueue::new(&weights, view_s);
        (0..sets).for_each(|set| unrequested.push(set, vec![(0, ()); views]));
        let compositors = weighted.into_iter().map(|(node, _)| node).collect();
        let relayed = plan.relay_fanout.map(|fanout| Transfer::Relay(fanout.get() as usize));
        let habits = Habits { transfer: relayed.unwrap_or(habits.transfer), ..habits };
        let machines = cluster.machines.iter();
        let nodes = machines.map(|&machine| Node::new(machine, sets, habits.credit_views)).collect();
        Self {
            cluster,
            plan,
            habits,
            sets,
            nodes,
            unrequested,
            compositors,
            receivers: Vec::new(),
            now_s: 0.0,
            scheduled: BinaryHeap::new(),
            events: 0,
            due: vec![(views, 0.0); sets as usize],
        }
    }

    /// Sends the client's first messages. A compositor that is left without a view is not asked, and loads nothing.
    fn begin(&mut self) {
        for (place, &node) in self.compositors.iter().enumerate() {
            self.nodes[node].place = place;
        }
        let mut has_sent = true;
        while has_sent {
            has_sent = false;
            for node in self.compositors.clone() {
                has_sent |= self.send_message(node);
            }
        }
        let requested: Vec<usize> =
            self.compositors.iter().copied().filter(|&node| !self.nodes[node].messages.is_empty()).collect();
        self.receivers = receivers(self.plan, &requested, self.nodes.len());
        requested.into_iter().for_each(|node| self.advance(node));
    }

    /// Sends the next message to a compositor, if there is room for one.
    fn send_message(&mut self, node: usize) -> bool {
        let message = self.unrequested.next_message(self.nodes[node].place);
        let sent = message.map(|message| (message.set_index, message.views.len()));
        self.nodes[node].messages.extend(sent);
        sent.is_some()
    }

    /// The client receives frames, and requests more where there is room.
    fn client_received(&mut self, node: usize, views: usize) {
        let place = self.nodes[node].place;
        (0..views).for_each(|_| self.unrequested.received(place, self.now_s, false));
        while self.send_message(node) {}
    }

    /// Bytes of an image, or of one of the tiles that the plan cuts it into.
    fn part_bytes(&self) -> f64 {
        self.cluster.image_bytes / f64::from(self.plan.tile_count)
    }

    fn schedule(&mut self, at_s: f64, event: Event) {
        // Times are not negative, so that their bits are in their order.
        self.scheduled.push(Reverse((at_s.to_bits(), self.events, event)));
        self.events += 1;
    }

    /// Reads a compositor's messages: it waits for a set, fetches the next ones, and hands views over as credit allows.
    fn advance(&mut self, node: usize) {
        while let Some(&(set, _)) = self.nodes[node].messages.front() {
            if self.plan.policy != Policy::Direct && !self.prepare(node, set) {
                break;
            }
            if !self.nodes[node].hand_over() {
                break;
            }
        }
        self.start_device(node);
    }

    /// Whether a set is loaded; asks for it and those after it otherwise. Where samplers take turns, those of later sets
    /// need not wait for this one.
    fn prepare(&mut self, node: usize, set: u32) -> bool {
        let at_once = self.plan.sets_at_once();
        let ahead = at_once.max(self.habits.sets_ahead);
        self.ask(node, set);
        let loaded = self.nodes[node].loading[set as usize].loaded;
        if loaded || at_once > 1 {
            let last = self.sets.saturating_sub(1).min(set.saturating_add(ahead));
            (set + 1..=last).for_each(|next| self.ask(node, next));
        }
        loaded
    }

    /// Asks all samplers of a set for their images, once.
    fn ask(&mut self, node: usize, set: u32) {
        let plan = self.plan;
        let samplers: Vec<(usize, usize)> = plan
            .samplers_of(set)
            .iter()
            .filter_map(|share| Some((number_of(&share.node_name)?, share.image_indices.len())))
            .collect();
        let loading = &mut self.nodes[node].loading[set as usize];
        if std::mem::replace(&mut loading.requested, true) {
            return;
        }
        for (sampler, images) in samplers {
            self.images_requested(sampler, set, images, node);
        }
        // Under a relay, all images may have arrived before.
        self.load_if_complete(node, set);
    }

    fn images_requested(&mut self, sampler: usize, set: u32, images: usize, by: usize) {
        match &mut self.nodes[sampler].sampled[set as usize] {
            Sampled::Soon(askers) => askers.push(by),
            Sampled::Done => self.give(sampler, set, by),
            state @ Sampled::Not => {
                *state = Sampled::Soon(vec![by]);
                self.nodes[sampler].urgent.push_back(Job::Sample { set, images });
                self.start_device(sampler);
            }
        }
    }

    /// Gives a set's images to a compositor that asked. Its own images need no link, and under a relay others send them.
    fn give(&mut self, sampler: usize, set: u32, to: usize) {
        if to == sampler {
            self.images_arrived(to, set);
        } else if self.habits.transfer == Transfer::Unicast {
            self.send_images(sampler, sampler, set, to);
        }
    }

    /// `place` is the receiver itself in unicast, and its place in the sampler's list under a relay.
    fn send_images(&mut self, from: usize, sampler: usize, set: u32, place: usize) {
        let share = self.plan.samplers_of(set).iter().find(|share| number_of(&share.node_name) == Some(sampler));
        let images = share.map_or(0, |share| share.image_indices.len());
        self.nodes[from].outgoing.push_back(Parcel::Images { set, sampler, images, place });
        self.start_link(from);
    }

    /// Relays images that arrived, in a tree over the sampler's receivers.
    fn relay(&mut self, from: usize, sampler: usize, set: u32, place: Option<usize>) {
        let Transfer::Relay(children) = self.habits.transfer else { return };
        let receivers = self.receivers[sampler].len();
        let children = children.max(1);
        let first = place.map_or(0, |place| children * place + 1);
        let count = if place.is_some() { children } else { 1 };
        for place in (first..first + count).filter(|&place| place < receivers) {
            self.send_images(from, sampler, set, place);
        }
    }

    fn images_arrived(&mut self, node: usize, set: u32) {
        self.nodes[node].loading[set as usize].arrived += 1;
        self.load_if_complete(node, set);
    }

    fn load_if_complete(&mut self, node: usize, set: u32) {
        let shares = self.plan.samplers_of(set).len();
        let loading = &mut self.nodes[node].loading[set as usize];
        if loading.requested && loading.arrived == shares && !std::mem::replace(&mut loading.queued, true) {
            self.nodes[node].urgent.push_back(Job::Load { set });
            self.start_device(node);
        }
    }

    fn start_device(&mut self, node: usize) {
        let policy = self.plan.policy;
        let tiles = self.plan.tile_count as usize;
        let this = &mut self.nodes[node];
        if this.running.is_some() {
            return;
        }
        let Some(job) = this.next_job(self.habits.batch_views) else { return };
        let Machine { costs, calls, .. } = this.machine;
        let (call_s, view_s) = match policy {
            Policy::Direct => (calls.direct_s, costs.direct_view_s),
            _ => (calls.reconstruct_s, costs.reconstruct_view_s),
        };
        let (seconds, busy) = match job {
            Job::Sample { images, .. } => (images as f64 * costs.sample_tile_s(tiles), &mut this.busy.sample_s),
            Job::Load { .. } => (costs.load_set_s, &mut this.busy.load_s),
            Job::Views { views, .. } => {
                (call_s + views as f64 * (view_s + costs.encode_view_s), &mut this.busy.views_s)
            }
        };
        *busy += seconds;
        this.running = Some(job);
        self.schedule(self.now_s + seconds, Event::Done { node });
    }

    fn done(&mut self, node: usize) {
        match self.nodes[node].running.take() {
            Some(Job::Sample { set, .. }) => {
                let state = std::mem::replace(&mut self.nodes[node].sampled[set as usize], Sampled::Done);
                let askers = if let Sampled::Soon(askers) = state { askers } else { Vec::new() };
                askers.into_iter().for_each(|to| self.give(node, set, to));
                self.relay(node, node, set, None);
            }
            Some(Job::Load { set }) => {
                self.nodes[node].loading[set as usize].loaded = true;
                self.advance(node);
            }
            Some(Job::Views { set, views }) => {
                let most = views.div_ceil(PARCELS).max(1);
                let parcels = (0..views).step_by(most).map(|first| most.min(views - first));
                self.nodes[node].outgoing.extend(parcels.map(|views| Parcel::Frames { set, views }));
                self.start_link(node);
            }
            None => (),
        }
        self.start_device(node);
    }

    fn start_link(&mut self, node: usize) {
        if self.nodes[node].sending.is_some() {
            return;
        }
        let Some(parcel) = self.nodes[node].outgoing.pop_front() else { return };
        self.nodes[node].sending = Some(parcel);
        let seconds = match parcel {
            Parcel::Images { set, sampler, images, place } => {
                let seconds = images as f64 * self.part_bytes() / self.nodes[node].machine.bytes_per_s;
                self.nodes[node].busy.images_out_s += seconds;
                self.receive(sampler, set, images, place, seconds);
                seconds
            }
            Parcel::Frames { views, .. } => {
                let seconds = views as f64 * self.cluster.frame_bytes / self.nodes[node].machine.bytes_per_s;
                self.nodes[node].busy.frames_out_s += seconds;
                seconds
            }
        };
        self.schedule(self.now_s + seconds, Event::Sent { node });
    }

    /// Occupies the receiver's link behind the parcels before.
    fn receive(&mut self, sampler: usize, set: u32, images: usize, place: usize, sending_s: f64) {
        let node = match self.habits.transfer {
            Transfer::Unicast => place,
            Transfer::Relay(_) => self.receivers[sampler][place],
        };
        let part_bytes = self.part_bytes();
        let this = &mut self.nodes[node];
        let seconds = images as f64 * part_bytes / this.machine.bytes_per_s;
        let end_s = (this.in_free_s.max(self.now_s) + seconds).max(self.now_s + sending_s);
        this.in_free_s = end_s;
        this.busy.in_s += seconds;
        self.schedule(end_s, Event::Arrived { sampler, set, place, node });
    }

    fn sent(&mut self, node: usize) {
        if let Some(Parcel::Frames { set, views }) = self.nodes[node].sending.take() {
            let (due, last_s) = &mut self.due[set as usize];
            *due -= views;
            *last_s = self.now_s;
            self.nodes[node].credit += views;
            self.client_received(node, views);
            self.advance(node);
        }
        self.start_link(node);
    }
}
