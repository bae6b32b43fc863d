//! What came of the loads: tables, charts, checks.

use std::collections::BTreeMap;

use app_core::live::{Record, STAGES, Shown, latencies, quantile};
use study::{Axis, Bar, BarChart, Cell, Check, Report, Series, Table, XyChart};

use super::crowd::Outcome;
use super::phases::{Idle, Load, Phases};

/// Of what was asked for, undegraded.
const DELIVERED: f64 = 0.99;
/// Of the rate that a client asked for and was admitted with.
const KEPT_RATE: f64 = 0.8;
/// MiB of an idle client, on all servers together.
const IDLE_MIB: f64 = 1.0;
/// Memory that a process may have gained at the end, as a share.
const GROWTH: f64 = 0.05;
/// Of a load's time: until then caches fill, and those come who are refused later.
const SETTLING: f64 = 0.25;

/// Adds tables, charts and checks.
///
/// # Errors
/// A row that does not fit, which is a fault here.
pub fn add(phases: &Phases, report: &mut Report) -> anyhow::Result<()> {
    report.tables.push(clients(&phases.loads)?);
    for load in &phases.loads {
        report.tables.push(latencies(&format!("From pose to picture, {}", load.name), load.shown())?);
    }
    report.tables.push(fallbacks(&phases.loads)?);
    report.tables.push(drops(&phases.loads)?);
    report.tables.push(memory(&phases.loads)?);
    report.tables.push(idle(&phases.idle)?);
    report.charts.push(ages(&phases.loads).into());
    report.charts.push(stages(&phases.loads).into());
    report.charts.extend(phases.loads.first().map(|load| memory_chart(load).into()));
    report.checks.extend(checks(phases));
    Ok(())
}

impl Load {
    fn served(&self) -> impl Iterator<Item = &Record> {
        self.outcomes.iter().filter_map(|outcome| match outcome {
            Outcome::Served(record) => Some(record),
            Outcome::Refused(_) => None,
        })
    }

    fn shown(&self) -> impl Iterator<Item = &Shown> {
        self.served().flat_map(|record| &record.shown)
    }

    fn refused(&self) -> usize {
        self.outcomes.len() - self.served().count()
    }

    fn posed(&self) -> u64 {
        self.served().map(|record| record.posed).sum()
    }

    fn degraded(&self) -> usize {
        self.shown().filter(|shown| shown.fallback > 0).count()
    }

    /// Of the poses of clients that were served, those whose frame came as it was asked for.
    fn undegraded_share(&self) -> f64 {
        (self.shown().count() - self.degraded()) as f64 / self.posed() as f64
    }

    /// In milliseconds.
    fn age_ms(&self, share: f64) -> f64 {
        let mut ages: Vec<f64> = self.shown().map(Shown::age_s).collect();
        ages.sort_by(f64::total_cmp);
        quantile(&ages, share) * 1e3
    }

    /// Of the rate that each client asked for, what it got once all had settled; the least first.
    fn rate_shares(&self) -> Vec<f64> {
        let lasting_s = self.crowd.lasting.as_secs_f64();
        let from_s = lasting_s * SETTLING;
        let of = |record: &Record| {
            let count = record.shown.iter().filter(|shown| (from_s..lasting_s).contains(&shown.posed_s)).count();
            count as f64 / ((lasting_s - from_s) * self.crowd.rate_hz)
        };
        let mut shares: Vec<f64> = self.served().map(of).collect();
        shares.sort_by(f64::total_cmp);
        shares
    }
}

fn clients(loads: &[Load]) -> anyhow::Result<Table> {
    let columns = [
        ("clients × frames/s", ""),
        ("admitted", ""),
        ("refused", ""),
        ("poses", ""),
        ("frames", ""),
        ("undegraded", "%"),
        ("degraded", "%"),
        ("rate kept, worst client", "%"),
        ("rate kept, mean", "%"),
        ("age, median", "ms"),
        ("age, 99 %", "ms"),
    ];
    let mut table = Table::new("Clients", &columns);
    for load in loads {
        let shares = load.rate_shares();
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        let counts = [load.served().count(), load.refused(), load.posed() as usize, load.shown().count()];
        let numbers = [
            load.undegraded_share() * 100.0,
            load.degraded() as f64 / load.posed() as f64 * 100.0,
            quantile(&shares, 0.0) * 100.0,
            mean * 100.0,
            load.age_ms(0.5),
            load.age_ms(0.99),
        ];
        let head = [Cell::from(load.name.clone())].into_iter().chain(counts.map(Cell::from));
        table.push(head.chain(numbers.map(Cell::from)))?;
    }
    Ok(table)
}

/// In the order in which they were come to.
fn fallbacks(loads: &[Load]) -> anyhow::Result<Table> {
    let columns = [("clients × frames/s", ""), ("fallback", ""), ("first", "s"), ("frames", ""), ("of all", "%")];
    let mut table = Table::new("Frames by what they make do with", &columns);
    for load in loads {
        let mut steps: BTreeMap<u32, (f64, usize)> = BTreeMap::new();
        for shown in load.shown() {
            let (first_s, count) = steps.entry(shown.fallback).or_insert((f64::INFINITY, 0));
            (*first_s, *count) = (first_s.min(shown.shown_s), *count + 1);
        }
        for (fallback, (first_s, count)) in steps {
            let share = count as f64 / load.shown().count() as f64 * 100.0;
            let numbers = [Cell::from(fallback), first_s.into(), count.into(), share.into()];
            table.push([Cell::from(load.name.clone())].into_iter().chain(numbers))?;
        }
    }
    Ok(table)
}

fn drops(loads: &[Load]) -> anyhow::Result<Table> {
    let mut table = Table::new("Views dropped", &[("clients × frames/s", ""), ("reason", ""), ("views", "")]);
    for load in loads {
        for (reason, count) in &load.dropped {
            table.push([load.name.clone().into(), reason.clone().into(), (*count as f64).into()])?;
        }
    }
    Ok(table)
}

fn memory(loads: &[Load]) -> anyhow::Result<Table> {
    let columns = [
        ("clients × frames/s", ""),
        ("process", ""),
        ("start", "MiB"),
        ("end", "MiB"),
        ("gained a minute, after settling", "MiB"),
    ];
    let mut table = Table::new("Memory", &columns);
    for load in loads {
        for (name, looks) in &load.memory {
            let at = |look: Option<&(f64, f64)>| look.map_or(f64::NAN, |look| look.1);
            let numbers = [at(looks.first()), at(looks.last()), slope_mib_per_s(settled(looks)) * 60.0];
            table.push([load.name.clone().into(), name.clone().into()].into_iter().chain(numbers.map(Cell::from)))?;
        }
    }
    Ok(table)
}

fn idle(idle: &Idle) -> anyhow::Result<Table> {
    let columns = [("process", ""), ("before", "MiB"), ("with them", "MiB"), ("each", "KiB")];
    let mut table = Table::new(format!("{} idle clients", idle.clients), &columns);
    for (name, before, after) in &idle.memory {
        let each_kib = (after - before) / idle.clients as f64 * 1024.0;
        table.push([name.clone().into(), (*before).into(), (*after).into(), each_kib.into()])?;
    }
    Ok(table)
}

impl Idle {
    /// On all servers; what the clients themselves take is theirs.
    fn each_mib(&self) -> f64 {
        let servers = self.memory.iter().filter(|(name, ..)| name != "clients");
        servers.map(|(_, before, after)| after - before).sum::<f64>() / self.clients as f64
    }
}

fn settled(looks: &[(f64, f64)]) -> &[(f64, f64)] {
    &looks[(looks.len() as f64 * SETTLING) as usize..]
}

/// By least squares.
fn slope_mib_per_s(looks: &[(f64, f64)]) -> f64 {
    let count = looks.len() as f64;
    let mean = |value: fn(&(f64, f64)) -> f64| looks.iter().map(value).sum::<f64>() / count;
    let (x, y) = (mean(|look| look.0), mean(|look| look.1));
    let above: f64 = looks.iter().map(|look| (look.0 - x) * (look.1 - y)).sum();
    above / looks.iter().map(|look| (look.0 - x).powi(2)).sum::<f64>()
}

/// Of the process that gains most, by its slope, over the whole load and as a share of what it had.
fn growth(load: &Load) -> f64 {
    let of = |(_, looks): &(String, Vec<(f64, f64)>)| {
        let looks = settled(looks);
        let mean = looks.iter().map(|look| look.1).sum::<f64>() / looks.len() as f64;
        slope_mib_per_s(looks) * load.crowd.lasting.as_secs_f64() / mean
    };
    // The clients keep every frame's times.
    load.memory.iter().filter(|(name, _)| name != "clients").map(of).fold(f64::NAN, f64::max)
}

fn ages(loads: &[Load]) -> XyChart {
    let (x, y) = (Axis::log("age of a frame", "ms"), Axis::linear("frames that are no older", "%"));
    loads.iter().fold(XyChart::new("Age of frames", x, y), |chart, load| {
        let points = (0..=100).map(|percent| (load.age_ms(f64::from(percent) / 100.0), f64::from(percent)));
        chart.with(Series::line(load.name.clone(), points))
    })
}

fn stages(loads: &[Load]) -> BarChart {
    let bars = loads.iter().map(|load| load.name.clone());
    let chart = BarChart::new("Where a frame's time goes, mean", Axis::linear("time", "ms"), bars);
    let mean_ms = |load: &Load, stage: usize| {
        load.shown().map(|shown| shown.stages_s[stage]).sum::<f64>() * 1e3 / load.shown().count() as f64
    };
    STAGES.into_iter().enumerate().fold(chart, |chart, (stage, name)| {
        chart.with(name, loads.iter().map(|load| mean_ms(load, stage)).collect::<Vec<_>>())
    })
}

fn memory_chart(load: &Load) -> XyChart {
    let (x, y) = (Axis::linear("time", "s"), Axis::linear("resident memory", "MiB"));
    let chart = XyChart::new(format!("Memory, {}", load.name), x, y);
    load.memory.iter().fold(chart, |chart, (name, looks)| chart.with(Series::line(name.clone(), looks.iter().copied())))
}

fn checks(phases: &Phases) -> Vec<Check> {
    let mut checks = Vec::new();
    if let [few, many, far_too_many] = &phases.loads[..] {
        let name = format!("{}: delivered undegraded", few.name);
        checks.push(Check::new(name, few.undegraded_share() * 100.0, "%", Bar::AtLeast(DELIVERED * 100.0)));
        checks.push(Check::new(format!("{}: refused", few.name), few.refused() as f64, "", Bar::Equal(0.0)));
        let name = format!("{}: memory gained, worst process", few.name);
        checks.push(Check::new(name, growth(few) * 100.0, "%", Bar::AtMost(GROWTH * 100.0)));
        checks.push(Check::new(format!("{}: refused", many.name), many.refused() as f64, "", Bar::Equal(0.0)));
        let name = format!("{}: refused with RESOURCE_EXHAUSTED", far_too_many.name);
        checks.push(Check::new(name, far_too_many.refused() as f64, "", Bar::AtLeast(1.0)));
        let name = format!("{}: rate that the worst admitted client keeps", far_too_many.name);
        let worst = quantile(&far_too_many.rate_shares(), 0.0);
        checks.push(Check::new(name, worst * 100.0, "%", Bar::AtLeast(KEPT_RATE * 100.0)));
    }
    let name = format!("{} idle sessions: memory of each on all servers", phases.idle.clients);
    checks.push(Check::new(name, phases.idle.each_mib(), "MiB", Bar::AtMost(IDLE_MIB)));
    checks
}

#[cfg(test)]
#[path = "report_tests.rs"]
mod tests;
