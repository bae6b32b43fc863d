//! The machines of a cluster, and the habits of its services.

use cluster::{Costs, TileCosts};

/// Seconds of a call to the device beside the views that it makes; 0 where it does not count.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Calls {
    /// Seconds of a call that reconstructs views.
    pub reconstruct_s: f64,
    /// Seconds of a call that draws views from the scene.
    pub direct_s: f64,
}

/// A node: a device and a network link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Machine {
    /// Seconds of one operation, of a view as one of a batch.
    pub costs: Costs,
    /// The time of every batch beside its views: reconstructed, and drawn directly.
    pub calls: Calls,
    /// The rate of the link, each way; infinite where it does not count.
    pub bytes_per_s: f64,
}

impl Machine {
    /// A machine that is `speed` times as fast, on the same link.
    #[must_use]
    pub fn faster(&self, speed: f64) -> Self {
        let costs = Costs {
            sample_image_s: self.costs.sample_image_s / speed,
            direct_view_s: self.costs.direct_view_s / speed,
            reconstruct_view_s: self.costs.reconstruct_view_s / speed,
            load_set_s: self.costs.load_set_s / speed,
            encode_view_s: self.costs.encode_view_s / speed,
            in_order: self.costs.in_order,
            tiles: self.costs.tiles.map(|tiles| TileCosts { overhead_s: tiles.overhead_s / speed, ..tiles }),
        };
        let calls = Calls { reconstruct_s: self.calls.reconstruct_s / speed, direct_s: self.calls.direct_s / speed };
        Self { costs, calls, ..*self }
    }

    /// A machine of these costs, on a link that does not count.
    #[must_use]
    pub fn of(costs: Costs) -> Self {
        Self { costs, calls: Calls::default(), bytes_per_s: f64::INFINITY }
    }
}

/// Machines and what travels between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Cluster {
    /// The nodes.
    pub machines: Vec<Machine>,
    /// S: work units of a sample set, be they images or parts of them.
    pub images: usize,
    /// B: one of them, encoded.
    pub image_bytes: f64,
    /// One encoded frame.
    pub frame_bytes: f64,
}

/// How images get to compositors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transfer {
    /// Each sampler sends to each compositor, as the services do unless the plan names relays.
    Unicast,
    /// Each sampler sends to one compositor; every receiver sends to this many others. With one it is a chain.
    Relay(usize),
}

/// The habits of the services.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Habits {
    /// The transfer of images.
    pub transfer: Transfer,
    /// Sets that a compositor asks samplers for beyond the one it has loaded.
    pub sets_ahead: u32,
    /// Most views of one call to the device.
    pub batch_views: usize,
    /// Views that a compositor has accepted and not sent yet.
    pub credit_views: usize,
}

impl Default for Habits {
    /// The habits of the real services.
    fn default() -> Self {
        Self { transfer: Transfer::Unicast, sets_ahead: 2, batch_views: 64, credit_views: 256 }
    }
}

/// `count` speeds, evenly spread over the logarithm between 1/√`ratio` and √`ratio` (SplitMix64).
#[must_use]
pub fn spread_speeds(count: usize, ratio: f64, seed: u64) -> Vec<f64> {
    let mut state = seed;
    let mut unit = || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..count).map(|_| ratio.powf(unit() - 0.5)).collect()
}
