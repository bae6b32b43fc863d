//! One simulated node: the queues of its device and its link, and the state of its stream of views.

use std::collections::VecDeque;

use crate::cluster::Machine;
use crate::run::Busy;

/// A job of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Job {
    /// All of the node's images of a set, in one go.
    Sample { set: u32, images: usize },
    /// A complete set, made ready.
    Load { set: u32 },
    /// A batch of views, reconstructed or drawn, and encoded.
    Views { set: u32, views: usize },
}

/// A parcel on a link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Parcel {
    /// A sampler's images of a set; `place` is the compositor's place in the sampler's list of receivers.
    Images { set: u32, sampler: usize, images: usize, place: usize },
    /// Frames to clients.
    Frames { set: u32, views: usize },
}

/// The state of a set on a sampler.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) enum Sampled {
    /// Not requested.
    #[default]
    Not,
    /// Being sampled, for these compositors.
    Soon(Vec<usize>),
    /// Cached for later requests.
    Done,
}

/// The state of a set on a compositor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Loading {
    pub(crate) requested: bool,
    /// Samplers whose images have arrived.
    pub(crate) arrived: usize,
    /// Whether it waits for the device, or has been loaded.
    pub(crate) queued: bool,
    pub(crate) loaded: bool,
}

/// A node at work.
#[derive(Debug, Clone)]
pub(crate) struct Node {
    pub(crate) machine: Machine,
    /// Sampling and loading, which go before the next batch of views.
    pub(crate) urgent: VecDeque<Job>,
    /// Views that wait for the device, by set, in their order.
    pub(crate) waiting: VecDeque<(u32, usize)>,
    pub(crate) running: Option<Job>,
    pub(crate) outgoing: VecDeque<Parcel>,
    pub(crate) sending: Option<Parcel>,
    /// The time at which the link is free for incoming parcels.
    pub(crate) in_free_s: f64,
    /// By set.
    pub(crate) sampled: Vec<Sampled>,
    /// By set.
    pub(crate) loading: Vec<Loading>,
    /// Messages that the node has not read: the set, and the views that have no credit yet.
    pub(crate) messages: VecDeque<(u32, usize)>,
    pub(crate) credit: usize,
    /// This node's place among the compositors.
    pub(crate) place: usize,
    pub(crate) busy: Busy,
}

impl Node {
    pub(crate) fn new(machine: Machine, sets: u32, credit: usize) -> Self {
        Self {
            machine,
            urgent: VecDeque::new(),
            waiting: VecDeque::new(),
            running: None,
            outgoing: VecDeque::new(),
            sending: None,
            in_free_s: 0.0,
            sampled: vec![Sampled::Not; sets as usize],
            loading: vec![Loading::default(); sets as usize],
            messages: VecDeque::new(),
            credit,
            place: 0,
            busy: Busy::default(),
        }
    }

    /// Hands over as many views of the first message as have credit; gives whether these were all.
    pub(crate) fn hand_over(&mut self) -> bool {
        let Some((set, left)) = self.messages.front_mut() else { return false };
        let set = *set;
        let views = (*left).min(self.credit);
        self.credit -= views;
        *left -= views;
        let all = *left == 0;
        match self.waiting.back_mut().filter(|(waiting, _)| *waiting == set) {
            Some((_, waiting)) => *waiting += views,
            None if views > 0 => self.waiting.push_back((set, views)),
            None => (),
        }
        if all {
            self.messages.pop_front();
        }
        all
    }

    /// The next job of the device.
    pub(crate) fn next_job(&mut self, batch_views: usize) -> Option<Job> {
        if let Some(job) = self.urgent.pop_front() {
            return Some(job);
        }
        let (set, waiting) = self.waiting.front_mut()?;
        let set = *set;
        let views = (*waiting).min(batch_views);
        *waiting -= views;
        if *waiting == 0 {
            self.waiting.pop_front();
        }
        Some(Job::Views { set, views })
    }
}
