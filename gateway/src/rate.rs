//! The size and the quality of pictures in motion, from the age of the pictures that were shown: down at once, up slowly.
//! It reads no clock.

use glam::UVec2;

/// Heights of pictures in motion: a closed set, so that the views of several visitors can be made together.
pub(crate) const HEIGHTS_PX: [u32; 8] = [90, 120, 180, 240, 360, 480, 720, 1080];
/// Widths are multiples of this.
const WIDTH_STEP_PX: u32 = 32;
/// JPEG qualities of the heights.
const QUALITIES: [u8; 8] = [60, 65, 70, 75, 75, 80, 80, 80];
/// The first height.
const FIRST: usize = 2;
/// The age that a picture may have beyond the round trip.
const BUDGET_S: f64 = 0.15;
/// The share of the budget that the next larger size may be predicted to take.
const ROOM: f64 = 0.7;
/// Ages that decide together, by their median.
const AGES: usize = 5;
/// The time at one size before a larger one is tried.
const PAUSE_S: f64 = 1.0;
/// The longest time before a size that was too large is tried again.
const LONGEST_PAUSE_S: f64 = 64.0;

/// A picture that was shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shown {
    /// From the input event to the screen.
    pub(crate) age_s: f64,
    /// The least round trip so far.
    pub(crate) rtt_s: f64,
    /// The height that the picture had.
    pub(crate) height_px: u32,
}

/// The choice for the next pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Chosen {
    rung: usize,
}

impl Chosen {
    pub(crate) fn height_px(self) -> u32 {
        HEIGHTS_PX[self.rung]
    }

    /// The JPEG quality.
    pub(crate) fn quality(self) -> u8 {
        QUALITIES[self.rung]
    }

    /// The size of a picture for a canvas. Its pixels need not be square.
    pub(crate) fn size_px(self, canvas_px: UVec2) -> UVec2 {
        let height = self.height_px();
        let width = f64::from(height) * f64::from(canvas_px.x) / f64::from(canvas_px.y.max(1));
        let steps = (width / f64::from(WIDTH_STEP_PX)).round().clamp(1.0, 64.0);
        UVec2::new(steps as u32 * WIDTH_STEP_PX, height)
    }
}

/// The controller of one visitor.
#[derive(Debug)]
pub(crate) struct Rate {
    rung: usize,
    /// The highest rung that the canvas has a use for.
    highest: usize,
    ages_s: Vec<f64>,
    /// The time since which the rung is what it is.
    since_s: f64,
    /// For each rung, the time before which it is not tried again, and the pause after its next failure.
    failed: [(f64, f64); HEIGHTS_PX.len()],
}

impl Default for Rate {
    fn default() -> Self {
        let failed = [(f64::NEG_INFINITY, 2.0 * PAUSE_S); HEIGHTS_PX.len()];
        Self { rung: FIRST, highest: HEIGHTS_PX.len() - 1, ages_s: Vec::new(), since_s: f64::NEG_INFINITY, failed }
    }
}

impl Rate {
    pub(crate) fn chosen(&self) -> Chosen {
        Chosen { rung: self.rung.min(self.highest) }
    }

    /// Pictures are not larger than the canvas.
    pub(crate) fn fit(&mut self, canvas_px: UVec2) {
        let larger = HEIGHTS_PX.iter().position(|height| *height >= canvas_px.y);
        self.highest = larger.unwrap_or(HEIGHTS_PX.len() - 1);
    }

    /// Learns from a picture that was shown at `now_s`.
    pub(crate) fn step(&mut self, now_s: f64, shown: Shown) {
        let rung = self.chosen().rung;
        if shown.height_px != HEIGHTS_PX[rung] {
            return;
        }
        self.ages_s.push(shown.age_s);
        let is_far_beyond = |age_s: &f64| age_s - shown.rtt_s > 2.0 * BUDGET_S;
        if rung > 0 && self.ages_s.len() >= 2 && self.ages_s.iter().rev().take(2).all(is_far_beyond) {
            return self.fail(now_s, rung);
        }
        if self.ages_s.len() < AGES {
            return;
        }
        let age_s = median(&mut self.ages_s);
        let beyond_s = (age_s - shown.rtt_s).max(0.0);
        if beyond_s > BUDGET_S && rung > 0 {
            self.fail(now_s, rung);
        } else if rung < self.highest && self.may_rise(now_s, beyond_s, rung) {
            self.go(now_s, rung + 1);
        } else {
            self.ages_s.remove(0);
        }
    }

    fn fail(&mut self, now_s: f64, rung: usize) {
        let (until_s, pause_s) = &mut self.failed[rung];
        *until_s = now_s + *pause_s;
        *pause_s = (*pause_s * 2.0).min(LONGEST_PAUSE_S);
        self.go(now_s, rung - 1);
    }

    /// Whether the next rung is predicted to have room, by the number of its pixels.
    fn may_rise(&self, now_s: f64, beyond_s: f64, rung: usize) -> bool {
        let side = f64::from(HEIGHTS_PX[rung + 1]) / f64::from(HEIGHTS_PX[rung]);
        let is_due = now_s - self.since_s >= PAUSE_S && now_s >= self.failed[rung + 1].0;
        is_due && beyond_s * side * side <= ROOM * BUDGET_S
    }

    fn go(&mut self, now_s: f64, rung: usize) {
        (self.rung, self.since_s) = (rung, now_s);
        self.ages_s.clear();
    }
}

fn median(values: &mut [f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A link and a device: the time of a picture, by its pixels.
    struct Link {
        bytes_s: f64,
        rtt_s: f64,
        pixel_s: f64,
        seed: u64,
    }

    impl Link {
        fn random(seed: u64) -> Self {
            let mut link = Self { bytes_s: 0.0, rtt_s: 0.0, pixel_s: 0.0, seed: seed + 1 };
            link.bytes_s = 60e3 * 500.0_f64.powf(link.uniform());
            link.rtt_s = 0.001 * 200.0_f64.powf(link.uniform());
            link.pixel_s = 2e-9 * 100.0_f64.powf(link.uniform());
            link
        }

        fn uniform(&mut self) -> f64 {
            self.seed = self.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.seed >> 11) as f64 / (1u64 << 53) as f64
        }

        /// The age of a picture of this height, beside 16:9, with noise of a tenth.
        fn age_s(&mut self, height_px: u32) -> f64 {
            let pixels = f64::from(height_px).powi(2) * 16.0 / 9.0;
            let work_s = 0.008 + pixels * self.pixel_s + pixels * 0.2 / self.bytes_s;
            self.rtt_s + work_s * (0.95 + 0.1 * self.uniform())
        }

        /// Heights over time, by a picture after the other.
        fn run(&mut self, rate: &mut Rate, from_s: f64, to_s: f64) -> Vec<(f64, u32)> {
            let (mut now_s, mut heights) = (from_s, Vec::new());
            while now_s < to_s {
                let height_px = rate.chosen().height_px();
                let age_s = self.age_s(height_px);
                now_s += (age_s / 2.0).max(0.033);
                rate.step(now_s, Shown { age_s, rtt_s: self.rtt_s, height_px });
                heights.push((now_s, height_px));
            }
            heights
        }
    }

    fn rung(height_px: u32) -> usize {
        HEIGHTS_PX.iter().position(|height| *height == height_px).unwrap()
    }

    #[test]
    fn no_link_makes_the_size_swing_by_more_than_a_rung() {
        for seed in 0..200 {
            let (mut link, mut rate) = (Link::random(seed), Rate::default());
            let heights = link.run(&mut rate, 0.0, 120.0);
            let late = heights.iter().filter(|(s, _)| *s > 30.0).map(|(_, height)| rung(*height));
            let (low, high) = late.clone().fold((9, 0), |(low, high), rung| (low.min(rung), high.max(rung)));
            assert!(high - low <= 1, "seed {seed}: rungs {low} to {high}");
            // Changes become rare.
            let late: Vec<usize> = late.collect();
            let changes = late.windows(2).filter(|pair| pair[0] != pair[1]).count();
            assert!(changes <= 12, "seed {seed}: {changes} changes in 90 s");
        }
    }

    #[test]
    fn the_age_stays_within_its_budget_where_any_size_does() {
        for seed in 0..200 {
            let (mut link, mut rate) = (Link::random(seed), Rate::default());
            link.run(&mut rate, 0.0, 30.0);
            let mut ages: Vec<f64> = (0..99).map(|_| link.age_s(rate.chosen().height_px())).collect();
            let fits = link.age_s(HEIGHTS_PX[0]) - link.rtt_s < 0.9 * BUDGET_S;
            assert!(!fits || median(&mut ages) <= link.rtt_s + 1.1 * BUDGET_S, "seed {seed}: {:?}", rate.chosen());
        }
    }

    #[test]
    fn a_freed_link_is_used_within_eight_seconds() {
        let mut slow = Link { bytes_s: 125e3, rtt_s: 0.08, pixel_s: 1e-8, seed: 7 };
        let mut rate = Rate::default();
        slow.run(&mut rate, 0.0, 20.0);
        assert!(rate.chosen().height_px() <= 240, "{:?}", rate.chosen());
        rate.fit(UVec2::new(640, 360));
        let mut free = Link { bytes_s: 1e8, rtt_s: 0.001, ..slow };
        free.run(&mut rate, 20.0, 28.0);
        assert_eq!(rate.chosen().height_px(), 360);
    }

    #[test]
    fn a_picture_that_is_far_too_old_makes_the_next_ones_smaller_at_once() {
        let mut rate = Rate::default();
        for number in 0..2 {
            rate.step(number as f64 * 0.05, Shown { age_s: 1.0, rtt_s: 0.01, height_px: HEIGHTS_PX[FIRST] });
        }
        assert_eq!(rate.chosen().height_px(), HEIGHTS_PX[FIRST - 1]);
    }

    #[test]
    fn sizes_keep_the_canvas_shape_to_half_a_step() {
        let chosen = |rung| Chosen { rung };
        assert_eq!(chosen(2).size_px(UVec2::new(640, 360)), UVec2::new(320, 180));
        assert_eq!(chosen(4).size_px(UVec2::new(640, 360)), UVec2::new(640, 360));
        assert_eq!(chosen(0).size_px(UVec2::new(1, 10_000)), UVec2::new(32, 90));
        assert_eq!(chosen(7).size_px(UVec2::new(16_384, 1)), UVec2::new(2048, 1080));
        let mut rate = Rate::default();
        rate.fit(UVec2::new(100, 100));
        assert_eq!(rate.chosen().height_px(), 120);
    }
}
