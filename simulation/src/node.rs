//! One simulated node: what waits for its device and its link, and how far its stream of views is.

use std::collections::VecDeque;

use crate::cluster::Machine;
use crate::run::Busy;

/// What a device does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Job {
    /// All of the node's images of a set, in one go.
    Sample { set: u32, images: usize },
    /// A complete set, made ready.
    Load { set: u32 },
    /// A batch of views, reconstructed or drawn, and encoded.
    Views { set: u32, views: usize },
}

/// What goes over a link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Parcel {
    /// A sampler's images of a set, to a compositor: the place in the sampler's list of receivers.
    Images { set: u32, sampler: usize, images: usize, place: usize },
    /// Frames to clients.
    Frames { set: u32, views: usize },
}

/// How far a sampler is with a set.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) enum Sampled {
    /// Nobody has asked.
    #[default]
    Not,
    /// Under way; who has asked meanwhile.
    Soon(Vec<usize>),
    /// Kept for whoever asks.
    Done,
}

/// How far a compositor is with a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Loading {
    pub(crate) asked: bool,
    /// Samplers whose images have come.
    pub(crate) came: usize,
    /// Waits for the device, or has been there.
    pub(crate) queued: bool,
    pub(crate) loaded: bool,
}

/// A node at work.
#[derive(Debug, Clone)]
pub(crate) struct Node {
    pub(crate) machine: Machine,
    /// Sampling and loading: what many wait for goes before the next batch of views.
    pub(crate) urgent: VecDeque<Job>,
    /// Views that wait for the device, by set, in their order.
    pub(crate) waiting: VecDeque<(u32, usize)>,
    pub(crate) running: Option<Job>,
    pub(crate) outgoing: VecDeque<Parcel>,
    pub(crate) sending: Option<Parcel>,
    /// When the link is free for what comes in.
    pub(crate) in_free_s: f64,
    /// By set.
    pub(crate) sampled: Vec<Sampled>,
    /// By set.
    pub(crate) loading: Vec<Loading>,
    /// Views of a set that are this node's.
    pub(crate) share: usize,
    /// The set whose views are being handed over, and how many of them still are to be.
    pub(crate) next_set: u32,
    pub(crate) to_hand_over: usize,
    pub(crate) credit: usize,
    pub(crate) busy: Busy,
}

impl Node {
    pub(crate) fn new(machine: Machine, sets: u32, share: usize, credit: usize) -> Self {
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
            share,
            next_set: 0,
            to_hand_over: share,
            credit,
            busy: Busy::default(),
        }
    }

    /// Hands over what there is credit for; whether that was all of the set.
    pub(crate) fn hand_over(&mut self) -> bool {
        let views = self.to_hand_over.min(self.credit);
        self.credit -= views;
        self.to_hand_over -= views;
        match self.waiting.back_mut().filter(|(set, _)| *set == self.next_set) {
            Some((_, waiting)) => *waiting += views,
            None if views > 0 => self.waiting.push_back((self.next_set, views)),
            None => (),
        }
        let all = self.to_hand_over == 0;
        if all {
            self.next_set += 1;
            self.to_hand_over = self.share;
        }
        all
    }

    /// What the device does next.
    pub(crate) fn next_job(&mut self, batch_views: usize) -> Option<Job> {
        if let Some(job) = self.urgent.pop_front() {
            return Some(job);
        }
        let (set, waiting) = self.waiting.front_mut()?;
        let (set, views) = (*set, (*waiting).min(batch_views));
        *waiting -= views;
        if *waiting == 0 {
            self.waiting.pop_front();
        }
        Some(Job::Views { set, views })
    }
}
