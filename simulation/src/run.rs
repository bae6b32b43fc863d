//! The result of a run: the times of complete sets, the busy parts, and the limit.

use std::fmt;

/// Seconds that parts of one node were busy in a whole run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Busy {
    /// The device, sampling.
    pub sample_s: f64,
    /// The device, loading sets.
    pub load_s: f64,
    /// The device, making views and encoding them.
    pub views_s: f64,
    /// The link, sending images.
    pub images_out_s: f64,
    /// The link, sending frames.
    pub frames_out_s: f64,
    /// The link, receiving images.
    pub in_s: f64,
}

impl Busy {
    fn device_s(&self) -> f64 {
        self.sample_s + self.load_s + self.views_s
    }
}

/// The part that limits a cluster's speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Limit {
    /// A device that samples whole images, be it beside its views.
    Sampling,
    /// A device that loads sets, beside its views.
    Loading,
    /// A device that makes views, while others have less to do.
    Uneven,
    /// Devices that make views: where it should be.
    Views,
    /// The link of a node that sends images to all others.
    ImagesOut,
    /// The link of a node that receives a whole set.
    ImagesIn,
    /// The link of a node that sends frames to clients.
    FramesOut,
    /// No part is busy all the time: each waits for another.
    Waiting,
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Sampling => "sampling whole images",
            Self::Loading => "loading sets",
            Self::Uneven => "uneven shares of views",
            Self::Views => "making views",
            Self::ImagesOut => "images out of a sampler",
            Self::ImagesIn => "images into a compositor",
            Self::FramesOut => "frames out of a compositor",
            Self::Waiting => "waiting for each other",
        })
    }
}

/// The times of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// The time at which the last view of each set was delivered.
    pub complete_s: Vec<f64>,
    /// The busy times of each node.
    pub busy: Vec<Busy>,
}

/// Sets after the last one that counts.
const DRAINING: usize = 4;
/// A part that is busy for less than this share of the time does not limit the rest.
const BUSY: f64 = 0.9;
/// A device that makes views for this share of its time is where it should be.
const MOSTLY: f64 = 0.8;

impl Run {
    /// T as it is measured: from the end of set 0 to the end of the set `counted_sets` later, a set.
    #[must_use]
    pub fn period_s(&self, counted_sets: usize) -> f64 {
        (self.set_complete_s(counted_sets) - self.set_complete_s(0)) / counted_sets as f64
    }

    /// The time at which this set and all before it are complete: sets that different nodes sample may end in another order.
    fn set_complete_s(&self, set: usize) -> f64 {
        self.complete_s.get(..=set).map_or(f64::NAN, |sets| sets.iter().copied().fold(0.0, f64::max))
    }

    /// T once the first sets have filled the cluster, by the order in which sets end. The last ones do not count: while they are made
    /// nothing is sampled ahead.
    #[must_use]
    pub fn steady_period_s(&self) -> f64 {
        let mut ends_s = self.complete_s.clone();
        ends_s.sort_by(f64::total_cmp);
        let last = ends_s.len().saturating_sub(1 + DRAINING);
        let first = last / 2;
        match ends_s.get(first..=last) {
            Some([begin_s, .., end_s]) => (end_s - begin_s) / (last - first) as f64,
            _ => f64::NAN,
        }
    }

    /// The limit: the part that is busy for the greatest share of T.
    #[must_use]
    pub fn limit(&self) -> Limit {
        let set_s = self.steady_period_s() * self.complete_s.len() as f64;
        let views_s = self.busy.iter().map(|busy| busy.views_s).sum::<f64>() / self.busy.len().max(1) as f64;
        let parts = self.busy.iter().flat_map(|busy| {
            let device = (busy.device_s(), of_device(busy, views_s));
            let out_s = busy.images_out_s + busy.frames_out_s;
            let out = if busy.images_out_s > busy.frames_out_s { Limit::ImagesOut } else { Limit::FramesOut };
            [device, (out_s, out), (busy.in_s, Limit::ImagesIn)]
        });
        let (busiest_s, limit) = parts.fold((0.0, Limit::Waiting), |a, b| if b.0 > a.0 { b } else { a });
        if busiest_s >= BUSY * set_s { limit } else { Limit::Waiting }
    }
}

/// The limit of a device that delays the rest; `mean_views_s` is the nodes' mean time on views.
fn of_device(busy: &Busy, mean_views_s: f64) -> Limit {
    if busy.views_s < MOSTLY * busy.device_s() {
        return if busy.sample_s > busy.load_s { Limit::Sampling } else { Limit::Loading };
    }
    if mean_views_s < MOSTLY * busy.views_s { Limit::Uneven } else { Limit::Views }
}
