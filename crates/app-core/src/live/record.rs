//! The record of a viewer: all its poses and frames.

use std::time::Instant;

use client::{ClientError, LiveFrame};
use report::{Cell, Table};

/// Stages of a frame's age, in order and complete.
pub const STAGES: [&str; 9] = [
    "waiting to be sent",
    "waiting for samples",
    "waiting for frames before it",
    "waiting for the device",
    "reconstructing its batch",
    "encoding",
    "waiting to go out",
    "network",
    "decoding",
];

/// A frame that was shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    /// The number of the frame and its pose, from 1.
    pub frame: u64,
    /// The time of the pose, since the start.
    pub posed_s: f64,
    /// The time at which the frame was decoded, since the start.
    pub shown_s: f64,
    /// The plan that made the frame.
    pub plan_epoch: u64,
    /// The set of that plan.
    pub set_index: u64,
    /// The age of its samples when the frame was made.
    pub set_age_s: f64,
    /// Seconds of each of [`STAGES`].
    pub stages_s: [f64; 9],
    /// The session's fallback that it was made with, from 1; 0 for none.
    pub fallback: u32,
}

impl Shown {
    pub(super) fn of(frame: &LiveFrame, start: Instant, fallback: u32) -> Self {
        let header = &frame.frame.header;
        let since = |time: Instant| time.saturating_duration_since(start).as_secs_f64();
        let there = header.stage_times;
        let away_s = frame.received.saturating_duration_since(frame.sent).as_secs_f64();
        Self {
            frame: frame.frame.request.frame,
            posed_s: since(frame.posed),
            shown_s: since(frame.decoded),
            plan_epoch: header.sample_set_id.plan_epoch,
            set_index: header.sample_set_id.index,
            set_age_s: there.set_age_s,
            stages_s: [
                since(frame.sent) - since(frame.posed),
                there.set_wait_s,
                there.credit_wait_s,
                there.queue_s,
                there.batch_s,
                there.encode_s,
                there.send_wait_s,
                (away_s - there.compositor_s).max(0.0),
                since(frame.decoded) - since(frame.received),
            ],
            fallback,
        }
    }

    /// Seconds from the pose to the picture.
    #[must_use]
    pub fn age_s(&self) -> f64 {
        self.shown_s - self.posed_s
    }
}

/// The record of one viewer.
#[derive(Debug, Clone, Default)]
pub struct Record {
    /// Frames, in the order in which they were shown.
    pub shown: Vec<Shown>,
    /// The number of poses that were due at the rate asked for.
    pub posed: u64,
    /// The error that ended the frames.
    pub error: Option<ClientError>,
    /// Seconds from the first pose to the end of the wait for frames.
    pub seconds: f64,
}

impl Record {
    /// The longest time without a new frame from `since_s` on, and its start. The wait for the first frame counts, and the
    /// time after the last.
    #[must_use]
    pub fn longest_gap_s(&self, since_s: f64) -> (f64, f64) {
        let shown = self.shown.iter().map(|shown| shown.shown_s).filter(|&shown_s| shown_s > since_s);
        let ends = shown.chain([self.seconds.max(since_s)]);
        let mut last_s = since_s;
        let gaps = ends.map(|end_s| (end_s - std::mem::replace(&mut last_s, end_s), end_s));
        let longest = gaps.fold((0.0, since_s), |a, b| if b.0 > a.0 { b } else { a });
        (longest.0, longest.1 - longest.0)
    }

    /// A table of every frame.
    ///
    /// # Errors
    /// A row does not fit its table.
    pub fn frames(&self) -> anyhow::Result<Table> {
        let head = ["frame", "posed", "shown", "plan_epoch", "set_index", "fallback", "age of its samples"];
        let units = ["", "s", "s", "", "", "", "s"];
        let stages = STAGES.into_iter().map(|name| (name, "s"));
        let columns: Vec<_> = head.into_iter().zip(units).chain(stages).collect();
        let mut table = Table::new("Frames", &columns);
        for shown in &self.shown {
            let numbers = [shown.frame as f64, shown.posed_s, shown.shown_s, shown.plan_epoch as f64];
            let rest = [shown.set_index as f64, shown.fallback.into(), shown.set_age_s];
            table.push(numbers.into_iter().chain(rest).chain(shown.stages_s).map(Cell::from))?;
        }
        Ok(table)
    }

    /// The record in one line.
    #[must_use]
    pub fn summary(&self) -> String {
        let Self { shown, posed, seconds, error } = self;
        let (gap_s, since_s) = self.longest_gap_s(0.0);
        let rate_hz = shown.len() as f64 / seconds.max(1e-9);
        let plans = shown.iter().map(|shown| shown.plan_epoch).collect::<std::collections::BTreeSet<_>>().len();
        let replaced = posed.saturating_sub(shown.len() as u64);
        let degraded = shown.iter().filter(|shown| shown.fallback > 0).count();
        let degraded = if degraded == 0 { String::new() } else { format!(", {degraded} with less than was asked for") };
        let error = error.as_ref().map_or_else(String::new, |error| format!("; then none: {error}"));
        format!(
            "{} frames shown of {posed} poses in {seconds:.1} s, {rate_hz:.1} a second, of {plans} plans{degraded}; \
             {replaced} poses were replaced by newer ones; longest without a new one {:.0} ms, from {since_s:.2} s on{error}",
            shown.len(),
            gap_s * 1e3
        )
    }
}

/// A table of the time of frames, stage by stage.
///
/// # Errors
/// A row does not fit its table.
pub fn latencies<'a>(name: &str, shown: impl Iterator<Item = &'a Shown>) -> anyhow::Result<Table> {
    let columns = [("stage", ""), ("mean", "ms"), ("median", "ms"), ("95 %", "ms"), ("99 %", "ms"), ("most", "ms")];
    let mut table = Table::new(name, &columns);
    let shown: Vec<&Shown> = shown.collect();
    let stages = STAGES.into_iter().enumerate();
    let stages = stages.map(|(at, name)| (name, shown.iter().map(|shown| shown.stages_s[at]).collect()));
    let whole = [
        ("age of a frame", shown.iter().map(|shown| shown.age_s()).collect()),
        ("age of its samples", shown.iter().map(|shown| shown.set_age_s).collect::<Vec<f64>>()),
    ];
    for (name, values_s) in stages.chain(whole) {
        table.push([Cell::from(name)].into_iter().chain(figures_ms(values_s).map(Cell::from)))?;
    }
    Ok(table)
}

/// Mean, median, 95 %, 99 % and maximum.
fn figures_ms(mut values_s: Vec<f64>) -> [f64; 5] {
    values_s.sort_by(f64::total_cmp);
    let mean = values_s.iter().sum::<f64>() / values_s.len() as f64;
    let shares = [0.5, 0.95, 0.99, 1.0].map(|share| quantile(&values_s, share));
    [mean, shares[0], shares[1], shares[2], shares[3]].map(|s| s * 1e3)
}

/// A quantile of sorted values; NaN without any.
#[must_use]
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = ((sorted.len() as f64 * share) as usize).min(sorted.len().wrapping_sub(1));
    sorted.get(at).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(frame: u64, shown_s: f64) -> Shown {
        let stages_s = [0.001, 0.0, 0.0, 0.001, 0.002, 0.001, 0.001, 0.003, 0.001];
        Shown {
            frame,
            posed_s: shown_s - 0.01,
            shown_s,
            plan_epoch: 1,
            set_index: 0,
            set_age_s: 0.5,
            stages_s,
            fallback: 0,
        }
    }

    #[test]
    fn a_gap_is_found_and_times_add_up() {
        let record = Record {
            shown: vec![shown(1, 0.1), shown(2, 0.2), shown(5, 1.7), shown(6, 1.8)],
            posed: 6,
            seconds: 2.0,
            error: None,
        };
        let (gap_s, since_s) = record.longest_gap_s(0.0);
        assert!((gap_s - 1.5).abs() < 1e-9 && (since_s - 0.2).abs() < 1e-9);
        let one = record.shown[0];
        assert!((one.stages_s.iter().sum::<f64>() - one.age_s()).abs() < 1e-9);
        let text = latencies("From pose to picture", record.shown.iter()).unwrap().to_text();
        assert!(text.contains("age of a frame") && !text.contains("NaN"), "{text}");
        let summary = record.summary();
        assert!(summary.contains("longest without a new one 1500 ms") && summary.contains("2 poses were"), "{summary}");
        assert_eq!(record.frames().unwrap().rows.len(), 4);
        assert!(latencies("none", [].iter()).is_ok());
    }

    #[test]
    fn a_viewer_without_frames_at_the_start_or_the_end_has_a_gap_there() {
        let record = |shown_s: &[f64], seconds: f64| {
            let shown = (1..).zip(shown_s).map(|(frame, &shown_s)| shown(frame, shown_s)).collect();
            Record { shown, posed: 9, seconds, error: None }
        };
        assert_eq!(record(&[3.0, 3.5], 4.0).longest_gap_s(0.0), (3.0, 0.0), "before the first frame");
        assert_eq!(record(&[0.5, 1.0], 4.0).longest_gap_s(0.0), (3.0, 1.0), "after the last");
        assert_eq!(record(&[], 4.0).longest_gap_s(0.0), (4.0, 0.0), "there is none");
        assert_eq!(record(&[0.5, 1.0, 3.5], 4.0).longest_gap_s(3.0), (0.5, 3.0), "earlier gaps do not count");
        assert_eq!(Record::default().longest_gap_s(0.0), (0.0, 0.0));
    }

    #[test]
    fn a_quantile_is_one_of_the_values() {
        let sorted: Vec<f64> = (0..100).map(f64::from).collect();
        assert_eq!([0.0, 0.5, 0.99, 1.0].map(|share| quantile(&sorted, share)), [0.0, 50.0, 99.0, 99.0]);
        assert!(quantile(&[], 0.5).is_nan());
    }
}
