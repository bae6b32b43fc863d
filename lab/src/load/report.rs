//! The report of the loads: tables, charts, checks.

use std::collections::BTreeMap;

use app_core::live::{latencies, quantile};
use report::{Axis, Bar, Cell, Check, Report, Series, Table, XyChart};

use super::memory::{growth, idle, memory, memory_chart};
use super::phases::{Load, Phases};
use crate::statistics::mean_of;
use crate::study::{Column, table};

/// The least share of frames that must come undegraded.
const DELIVERED: f64 = 0.99;
/// The least share of its rate that an admitted client must keep.
const KEPT_RATE: f64 = 0.8;
/// The most memory of an idle client on all servers together, in MiB.
const IDLE_MIB: f64 = 1.0;
/// The most memory that a process may gain, as a share.
const GROWTH: f64 = 0.05;

const CLIENTS: [Column<Load>; 12] = [
    Column::new("clients × frames/s", |load| load.name.as_str().into()),
    Column::new("admitted", |load| load.served().count().into()),
    Column::new("refused", |load| load.refused().into()),
    Column::new("poses", |load| (load.posed() as usize).into()),
    Column::new("frames", |load| load.shown().count().into()),
    Column::new("frames a second, all clients", |load| {
        (load.shown().count() as f64 / load.clients.lasting.as_secs_f64()).into()
    }),
    Column::with_unit("undegraded", "%", |load| (load.undegraded_share() * 100.0).into()),
    Column::with_unit("degraded", "%", |load| (load.degraded() as f64 / load.posed() as f64 * 100.0).into()),
    Column::with_unit("rate kept, worst client", "%", |load| (quantile(&load.rate_shares(), 0.0) * 100.0).into()),
    Column::with_unit("rate kept, mean", "%", |load| (mean_of(&load.rate_shares(), |share| *share) * 100.0).into()),
    Column::with_unit("age, median", "ms", |load| load.age_ms(0.5).into()),
    Column::with_unit("age, 99 %", "ms", |load| load.age_ms(0.99).into()),
];

/// Adds tables, charts and checks.
pub fn add(phases: &Phases, report: &mut Report) -> anyhow::Result<()> {
    report.tables.push(table("Clients", &CLIENTS, &phases.loads)?);
    for load in &phases.loads {
        report.tables.push(latencies(&format!("From pose to picture, {}", load.name), load.shown())?);
    }
    report.tables.push(fallbacks(&phases.loads)?);
    report.tables.push(drops(&phases.loads)?);
    report.tables.push(memory(&phases.loads)?);
    report.tables.push(idle(&phases.idle)?);
    report.charts.push(ages(&phases.loads));
    report.charts.extend(phases.loads.first().map(memory_chart));
    report.checks.extend(checks(phases));
    Ok(())
}

/// Fallbacks, in the order of their first use.
fn fallbacks(loads: &[Load]) -> anyhow::Result<Table> {
    let columns = [("clients × frames/s", ""), ("fallback", ""), ("first", "s"), ("frames", ""), ("of all", "%")];
    let mut table = Table::new("Frames by fallback", &columns);
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

fn ages(loads: &[Load]) -> XyChart {
    let x = Axis::log("age of a frame", "ms");
    let y = Axis::linear("frames that are no older", "%");
    loads.iter().fold(XyChart::new("Age of frames", x, y), |chart, load| {
        let points = (0..=100).map(|percent| (load.age_ms(f64::from(percent) / 100.0), f64::from(percent)));
        chart.with(Series::line(load.name.clone(), points))
    })
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
