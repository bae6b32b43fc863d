//! The size and the quality of pictures in motion, from the age of the pictures that were shown: down at once, up slowly.
//! It reads no clock.

use depth_image::LightCacheQuality;
use glam::UVec2;

/// Heights of pictures in motion: a closed set, so that the views of several visitors can be made together.
pub(crate) const HEIGHTS_PX: [u32; 8] = [90, 120, 180, 240, 360, 480, 720, 1080];
/// Widths are multiples of this.
const WIDTH_STEP_PX: u32 = 32;
/// JPEG qualities of the heights.
const JPEG_QUALITIES: [u8; 8] = [60, 65, 70, 75, 75, 80, 80, 80];
/// Qualities of shared light below the largest height: a larger picture says more than finer light.
const QUALITIES_PER_HEIGHT: usize = 2;
/// The first rung.
const FIRST: Rung = Rung { height: 2, quality: 0 };
/// The age that a picture may have beyond the round trip.
const BUDGET_S: f64 = 0.15;
/// The share of the budget that the next rung may be predicted to take.
const ROOM: f64 = 0.7;
/// The time of a picture over that of the next lower quality, at most.
const QUALITY_GROWTH: f64 = 1.5;
/// Ages that decide together, by their median.
const AGES: usize = 5;
/// The time on one rung before a higher one is tried.
const PAUSE_S: f64 = 1.0;
/// The longest time before a rung that was too high is tried again.
const LONGEST_PAUSE_S: f64 = 64.0;

/// A height, and the quality of shared light at that height, both by their places. A greater rung costs more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Rung {
    height: usize,
    quality: usize,
}

/// A picture that was shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shown {
    /// From the input event to the screen.
    pub(crate) age_s: f64,
    /// The least round trip so far.
    pub(crate) rtt_s: f64,
    /// The rung that was chosen for the picture.
    pub(crate) chosen: Rung,
}

impl Rung {
    pub(crate) fn height_px(self) -> u32 {
        HEIGHTS_PX[self.height]
    }

    pub(crate) fn jpeg_quality(self) -> u8 {
        JPEG_QUALITIES[self.height]
    }

    /// The quality of shared light, where light is shared.
    pub(crate) fn light(self) -> LightCacheQuality {
        LightCacheQuality::ALL[self.quality]
    }

    /// The size of a picture for a canvas. Its pixels need not be square.
    pub(crate) fn size_px(self, canvas_px: UVec2) -> UVec2 {
        let height = self.height_px();
        let width = f64::from(height) * f64::from(canvas_px.x) / f64::from(canvas_px.y.max(1));
        let steps = (width / f64::from(WIDTH_STEP_PX)).round().clamp(1.0, 64.0);
        UVec2::new(steps as u32 * WIDTH_STEP_PX, height)
    }
}

/// The controller of one visitor. At each height, light is a draft first and then fast; the largest height has all qualities.
#[derive(Debug)]
pub(crate) struct Rate {
    rung: Rung,
    /// The largest height that the canvas has a use for.
    highest: usize,
    /// Qualities of light, from the lowest: one where light is not shared.
    quality_count: usize,
    ages_s: Vec<f64>,
    /// The time since which the rung is what it is.
    since_s: f64,
    /// For each rung, the time before which it is not tried again, and the pause after its next failure.
    failed: [[(f64, f64); LightCacheQuality::ALL.len()]; HEIGHTS_PX.len()],
}

impl Default for Rate {
    fn default() -> Self {
        Self {
            rung: FIRST,
            highest: HEIGHTS_PX.len() - 1,
            quality_count: 1,
            ages_s: Vec::new(),
            since_s: f64::NEG_INFINITY,
            failed: [[(f64::NEG_INFINITY, 2.0 * PAUSE_S); LightCacheQuality::ALL.len()]; HEIGHTS_PX.len()],
        }
    }
}

impl Rate {
    /// The rung of the next pictures.
    pub(crate) fn chosen(&self) -> Rung {
        let height = self.rung.height.min(self.highest);
        let quality = if height < self.rung.height { QUALITIES_PER_HEIGHT - 1 } else { self.rung.quality };
        Rung { height, quality: quality.min(self.qualities_at(height) - 1) }
    }

    /// Pictures are not larger than the canvas.
    pub(crate) fn fit(&mut self, canvas_px: UVec2) {
        let larger = HEIGHTS_PX.iter().position(|height| *height >= canvas_px.y);
        self.highest = larger.unwrap_or(HEIGHTS_PX.len() - 1);
    }

    /// Light has this quality at most; `None` where it is not shared.
    pub(crate) fn limit(&mut self, best: Option<LightCacheQuality>) {
        self.quality_count = best.map_or(1, |best| LightCacheQuality::ALL.iter().filter(|&&q| q <= best).count());
    }

    fn qualities_at(&self, height: usize) -> usize {
        if height == self.highest { self.quality_count } else { self.quality_count.min(QUALITIES_PER_HEIGHT) }
    }

    fn above(&self, Rung { height, quality }: Rung) -> Option<Rung> {
        match quality + 1 {
            quality if quality < self.qualities_at(height) => Some(Rung { height, quality }),
            _ => (height < self.highest).then_some(Rung { height: height + 1, quality: 0 }),
        }
    }

    fn below(&self, Rung { height, quality }: Rung) -> Option<Rung> {
        match (quality.checked_sub(1), height.checked_sub(1)) {
            (Some(quality), _) => Some(Rung { height, quality }),
            (None, Some(height)) => Some(Rung { height, quality: self.qualities_at(height) - 1 }),
            (None, None) => None,
        }
    }

    /// Learns from a picture that was shown at `now_s`.
    pub(crate) fn step(&mut self, now_s: f64, shown: Shown) {
        if shown.chosen != self.chosen() {
            return;
        }
        let rung = shown.chosen;
        self.ages_s.push(shown.age_s);
        let below = self.below(rung);
        if let Some(below) = below.filter(|_| self.ages_s.len() >= 2)
            && self.ages_s.iter().rev().take(2).all(|age_s| age_s - shown.rtt_s > 2.0 * BUDGET_S)
        {
            return self.fail(now_s, rung, below);
        }
        if self.ages_s.len() < AGES {
            return;
        }
        let beyond_s = (median(&self.ages_s) - shown.rtt_s).max(0.0);
        match (below, self.above(rung)) {
            (Some(below), _) if beyond_s > BUDGET_S => self.fail(now_s, rung, below),
            (_, Some(above)) if self.may_rise(now_s, beyond_s, rung, above) => self.go(now_s, above),
            _ => {
                self.ages_s.remove(0);
            }
        }
    }

    fn fail(&mut self, now_s: f64, rung: Rung, below: Rung) {
        let (until_s, pause_s) = &mut self.failed[rung.height][rung.quality];
        *until_s = now_s + *pause_s;
        *pause_s = (*pause_s * 2.0).min(LONGEST_PAUSE_S);
        self.go(now_s, below);
    }

    /// Whether the next rung is predicted to have room, by the number of its pixels or the quality of its light.
    fn may_rise(&self, now_s: f64, beyond_s: f64, rung: Rung, above: Rung) -> bool {
        let side = f64::from(HEIGHTS_PX[above.height]) / f64::from(HEIGHTS_PX[rung.height]);
        let growth = if above.height == rung.height { QUALITY_GROWTH } else { side * side };
        let is_due = now_s - self.since_s >= PAUSE_S && now_s >= self.failed[above.height][above.quality].0;
        is_due && beyond_s * growth <= ROOM * BUDGET_S
    }

    fn go(&mut self, now_s: f64, rung: Rung) {
        (self.rung, self.since_s) = (rung, now_s);
        self.ages_s.clear();
    }
}

fn median(values: &[f64]) -> f64 {
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

        /// The age of a picture of this height, beside 16:9, with noise of a tenth. Each quality takes a third more time.
        fn age_s(&mut self, chosen: Rung) -> f64 {
            let pixels = f64::from(chosen.height_px()).powi(2) * 16.0 / 9.0;
            let pixel_s = self.pixel_s * 1.33_f64.powi(chosen.quality as i32);
            let work_s = 0.008 + pixels * pixel_s + pixels * 0.2 / self.bytes_s;
            self.rtt_s + work_s * (0.95 + 0.1 * self.uniform())
        }

        /// Heights over time, by a picture after the other.
        fn run(&mut self, rate: &mut Rate, from_s: f64, to_s: f64) -> Vec<(f64, u32)> {
            let mut now_s = from_s;
            let mut heights = Vec::new();
            while now_s < to_s {
                let chosen = rate.chosen();
                let age_s = self.age_s(chosen);
                now_s += (age_s / 2.0).max(0.033);
                rate.step(now_s, Shown { age_s, rtt_s: self.rtt_s, chosen });
                heights.push((now_s, chosen.height_px()));
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
            let mut link = Link::random(seed);
            let mut rate = Rate::default();
            rate.limit(LightCacheQuality::ALL.get(seed as usize % 6).copied());
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
            let mut link = Link::random(seed);
            let mut rate = Rate::default();
            link.run(&mut rate, 0.0, 30.0);
            let ages: Vec<f64> = (0..99).map(|_| link.age_s(rate.chosen())).collect();
            let lowest = Rung { height: 0, quality: 0 };
            let fits = link.age_s(lowest) - link.rtt_s < 0.9 * BUDGET_S;
            assert!(!fits || median(&ages) <= link.rtt_s + 1.1 * BUDGET_S, "seed {seed}: {:?}", rate.chosen());
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
    fn light_is_a_draft_then_fast_at_each_height_and_as_fine_as_allowed_at_the_largest() {
        let mut rate = Rate::default();
        rate.fit(UVec2::new(640, 360));
        rate.limit(Some(LightCacheQuality::Fine));
        let mut chosen = Vec::new();
        for number in 0..2000 {
            let now = rate.chosen();
            rate.step(number as f64 * 0.05, Shown { age_s: 0.01, rtt_s: 0.005, chosen: now });
            chosen.push((now.height_px(), now.light().name()));
        }
        chosen.dedup();
        let expected = [
            (180, "draft"),
            (180, "fast"),
            (240, "draft"),
            (240, "fast"),
            (360, "draft"),
            (360, "fast"),
            (360, "balanced"),
            (360, "fine"),
        ];
        assert_eq!(chosen, expected);
        rate.limit(Some(LightCacheQuality::Fast));
        assert_eq!(rate.chosen().light(), LightCacheQuality::Fast, "the visitor wants no more");
        rate.fit(UVec2::new(320, 180));
        assert_eq!((rate.chosen().height_px(), rate.chosen().light()), (180, LightCacheQuality::Fast));
        rate.limit(None);
        assert_eq!(rate.chosen().light(), LightCacheQuality::Draft, "light is not shared");
    }

    #[test]
    fn a_picture_that_is_far_too_old_makes_the_next_ones_smaller_at_once() {
        let mut rate = Rate::default();
        for number in 0..2 {
            rate.step(number as f64 * 0.05, Shown { age_s: 1.0, rtt_s: 0.01, chosen: FIRST });
        }
        assert_eq!(rate.chosen().height_px(), HEIGHTS_PX[FIRST.height - 1]);
    }

    #[test]
    fn sizes_keep_the_canvas_shape_to_half_a_step() {
        let chosen = |height| Rung { height, quality: 0 };
        assert_eq!(chosen(2).size_px(UVec2::new(640, 360)), UVec2::new(320, 180));
        assert_eq!(chosen(4).size_px(UVec2::new(640, 360)), UVec2::new(640, 360));
        assert_eq!(chosen(0).size_px(UVec2::new(1, 10_000)), UVec2::new(32, 90));
        assert_eq!(chosen(7).size_px(UVec2::new(16_384, 1)), UVec2::new(2048, 1080));
        let mut rate = Rate::default();
        rate.fit(UVec2::new(100, 100));
        assert_eq!(rate.chosen().height_px(), 120);
    }
}
