//! A client that moves: poses at a set rate, the newest frame shown, and where each frame's time went.

use std::sync::Arc;
use std::time::{Duration, Instant};

use client::{ClientError, Frame, Session, ViewRequest};
use depth_image::PinholeCamera;
use study::{Cell, Table};
use tokio::sync::Semaphore;
use tokio::task::JoinSet;
use tokio::time::MissedTickBehavior;

/// Frames that may be on their way at once: a third would only be older when it came.
const CREDITS: usize = 2;

/// A path, and how it is followed.
#[derive(Debug, Clone)]
pub struct Drive {
    /// One pose after the other; after the last comes the first.
    pub path: Vec<PinholeCamera>,
    /// Poses a second.
    pub rate_hz: f64,
    /// For how long.
    pub lasting: Duration,
    /// Seconds between sample sets of a scene that moves.
    pub set_step_s: f64,
    /// How many there are, shown over and over.
    pub set_count: u32,
}

/// A frame that was shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    /// Its number: the pose's.
    pub frame: u64,
    /// When its pose was due, since the start.
    pub posed_s: f64,
    /// When it was here, decoded.
    pub shown_s: f64,
    /// Of the plan that made it.
    pub plan_epoch: u64,
    /// Of that plan.
    pub set_index: u64,
    /// At the compositor: until the set was there, in the queue, reconstructing, encoding.
    pub stages_s: [f64; 4],
}

impl Shown {
    fn age_s(&self) -> f64 {
        self.shown_s - self.posed_s
    }

    /// What no stage at the compositor accounts for: both ways on the network, and decoding.
    fn travel_s(&self) -> f64 {
        (self.age_s() - self.stages_s.iter().sum::<f64>()).max(0.0)
    }
}

/// What became of all poses.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Record {
    /// In the order they were shown.
    pub shown: Vec<Shown>,
    /// Poses for which nothing was asked, as two frames were on their way.
    pub busy: usize,
    /// Frames that came after a later one.
    pub stale: usize,
    /// Frames that did not come, and why the last of them did not.
    pub failed: usize,
    /// Of the last that did not come.
    pub last_error: Option<String>,
    /// From the first pose to the last frame.
    pub seconds: f64,
}

/// Follows the path.
///
/// # Errors
/// Where a request cannot be: the session has ended, or a pose is not valid.
pub async fn drive(session: &Session, drive: &Drive) -> Result<Record, ClientError> {
    let (start, credits) = (Instant::now(), Arc::new(Semaphore::new(CREDITS)));
    let mut ticks = tokio::time::interval(Duration::from_secs_f64(1.0 / drive.rate_hz));
    ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let (mut record, mut calls, mut frame) = (Record::default(), JoinSet::new(), 0);
    while start.elapsed() < drive.lasting {
        tokio::select! {
            _ = ticks.tick() => {
                match credits.clone().try_acquire_owned() {
                    Err(_) => record.busy += 1,
                    Ok(credit) => {
                        let posed_s = start.elapsed().as_secs_f64();
                        let mut frames = session.render_views(vec![drive.pose(frame, posed_s)])?;
                        calls.spawn(async move {
                            let came = frames.next().await;
                            drop(credit);
                            (posed_s, start.elapsed().as_secs_f64(), came)
                        });
                    }
                }
                frame += 1;
            }
            Some(ended) = calls.join_next() => record.take(ended.ok()),
        }
    }
    while let Some(ended) = calls.join_next().await {
        record.take(ended.ok());
    }
    record.seconds = start.elapsed().as_secs_f64();
    Ok(record)
}

impl Drive {
    fn pose(&self, frame: u64, posed_s: f64) -> ViewRequest {
        let camera = self.path[(frame % self.path.len() as u64) as usize];
        let set_index = ((posed_s / self.set_step_s) as u64 % u64::from(self.set_count)) as u32;
        ViewRequest { frame, set_index, camera }
    }
}

type Call = (f64, f64, Option<Result<Frame, ClientError>>);

impl Record {
    fn take(&mut self, call: Option<Call>) {
        let Some((posed_s, shown_s, came)) = call else { return };
        let frame = match came {
            Some(Ok(frame)) => frame,
            Some(Err(error)) => return self.fail(error.to_string()),
            None => return self.fail("the frame did not come".to_owned()),
        };
        if self.shown.last().is_some_and(|last| last.frame > frame.request.frame) {
            self.stale += 1;
            return;
        }
        let times = frame.header.stage_times;
        self.shown.push(Shown {
            frame: frame.request.frame,
            posed_s,
            shown_s,
            plan_epoch: frame.header.sample_set_id.plan_epoch,
            set_index: frame.header.sample_set_id.index,
            stages_s: [times.set_wait_s, times.queue_s, times.reconstruct_s, times.encode_s],
        });
    }

    fn fail(&mut self, error: String) {
        self.failed += 1;
        self.last_error = Some(error);
    }

    /// The longest time without a new frame, and since when.
    #[must_use]
    pub fn longest_gap_s(&self) -> Option<(f64, f64)> {
        let gaps = self.shown.windows(2).map(|pair| (pair[1].shown_s - pair[0].shown_s, pair[0].shown_s));
        gaps.max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Where frames' time went, stage by stage.
    ///
    /// # Errors
    /// A row that does not fit, which is a fault here.
    pub fn latencies(&self) -> anyhow::Result<Table> {
        let columns = [("stage", ""), ("mean", "ms"), ("median", "ms"), ("95 %", "ms"), ("99 %", "ms"), ("most", "ms")];
        let mut table = Table::new("From pose to picture", &columns);
        let stage = |number: usize| move |shown: &Shown| shown.stages_s[number];
        let of = |values: Vec<f64>| figures_ms(values);
        let each = |value: &dyn Fn(&Shown) -> f64| self.shown.iter().map(value).collect::<Vec<f64>>();
        let rows = [
            ("waiting for samples", of(each(&stage(0)))),
            ("waiting for the device", of(each(&stage(1)))),
            ("reconstructing", of(each(&stage(2)))),
            ("encoding", of(each(&stage(3)))),
            ("network and decoding", of(each(&Shown::travel_s))),
            ("age of a frame", of(each(&Shown::age_s))),
        ];
        for (name, figures) in rows {
            table.push([Cell::from(name)].into_iter().chain(figures.map(Cell::from)))?;
        }
        Ok(table)
    }

    /// Every frame that was shown.
    ///
    /// # Errors
    /// As [`Record::latencies`].
    pub fn frames(&self) -> anyhow::Result<Table> {
        let columns = [
            ("frame", ""),
            ("posed", "s"),
            ("shown", "s"),
            ("plan_epoch", ""),
            ("set_index", ""),
            ("set wait", "s"),
            ("queue", "s"),
            ("reconstruct", "s"),
            ("encode", "s"),
        ];
        let mut table = Table::new("Frames", &columns);
        for shown in &self.shown {
            let head = [shown.frame as f64, shown.posed_s, shown.shown_s, shown.plan_epoch as f64];
            let all = head.into_iter().chain([shown.set_index as f64]).chain(shown.stages_s);
            table.push(all.map(Cell::from))?;
        }
        Ok(table)
    }

    /// In one line.
    #[must_use]
    pub fn summary(&self) -> String {
        let Self { shown, busy, stale, failed, seconds, .. } = self;
        let gap = self.longest_gap_s().map_or_else(String::new, |(gap_s, since_s)| {
            format!("; longest without a new one {:.0} ms, from {since_s:.2} s on", gap_s * 1e3)
        });
        let rate_hz = shown.len() as f64 / seconds.max(1e-9);
        let plans = shown.iter().map(|shown| shown.plan_epoch).collect::<std::collections::BTreeSet<_>>().len();
        let error = self.last_error.as_ref().map_or_else(String::new, |error| format!(" (the last: {error})"));
        format!(
            "{} frames shown in {seconds:.1} s, {rate_hz:.1} a second, of {plans} plans; not asked for while two were on \
             their way {busy}, too late {stale}, failed {failed}{error}{gap}",
            shown.len()
        )
    }
}

/// Mean, median, 95 %, 99 % and most.
fn figures_ms(mut values_s: Vec<f64>) -> [f64; 5] {
    values_s.sort_by(f64::total_cmp);
    let at = |share: f64| values_s.get(((values_s.len() as f64 * share) as usize).min(values_s.len().wrapping_sub(1)));
    let mean = values_s.iter().sum::<f64>() / values_s.len() as f64;
    let shares = [0.5, 0.95, 0.99, 1.0].map(|share| at(share).copied().unwrap_or(f64::NAN));
    [mean, shares[0], shares[1], shares[2], shares[3]].map(|s| s * 1e3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(frame: u64, shown_s: f64) -> Shown {
        let stages_s = [0.0, 0.001, 0.002, 0.003];
        Shown { frame, posed_s: shown_s - 0.01, shown_s, plan_epoch: 1, set_index: 0, stages_s }
    }

    #[test]
    fn a_gap_is_found_and_times_add_up() {
        let record = Record {
            shown: vec![shown(0, 0.1), shown(1, 0.2), shown(2, 1.7), shown(3, 1.8)],
            seconds: 2.0,
            ..Record::default()
        };
        let (gap_s, since_s) = record.longest_gap_s().unwrap();
        assert!((gap_s - 1.5).abs() < 1e-9 && (since_s - 0.2).abs() < 1e-9);
        assert!((record.shown[0].travel_s() - 0.004).abs() < 1e-9);
        let text = crate::text_table::text(&record.latencies().unwrap());
        assert!(text.contains("age of a frame") && !text.contains("NaN"), "{text}");
        assert!(record.summary().contains("longest without a new one 1500 ms"), "{}", record.summary());
        assert!(Record::default().latencies().is_ok() && Record::default().longest_gap_s().is_none());
    }
}
