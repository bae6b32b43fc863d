//! Memory of processes under load.

use report::{Axis, Cell, Series, Table, XyChart};

use super::phases::{Idle, Load};
use super::statistics::WARM_UP;
use crate::statistics::mean_of;

pub(super) fn memory(loads: &[Load]) -> anyhow::Result<Table> {
    let columns = [
        ("clients × frames/s", ""),
        ("process", ""),
        ("start", "MiB"),
        ("end", "MiB"),
        ("gained a minute, after warm-up", "MiB"),
    ];
    let mut table = Table::new("Memory", &columns);
    for load in loads {
        for (name, looks) in &load.memory {
            let [first, last] = [looks.first(), looks.last()].map(|look| look.map_or(f64::NAN, |look| look.1));
            let numbers = [first, last, slope_mib_per_s(steady(looks)) * 60.0];
            table.push([load.name.clone().into(), name.clone().into()].into_iter().chain(numbers.map(Cell::from)))?;
        }
    }
    Ok(table)
}

pub(super) fn idle(idle: &Idle) -> anyhow::Result<Table> {
    let columns = [("process", ""), ("before", "MiB"), ("with them", "MiB"), ("each", "KiB")];
    let mut table = Table::new(format!("{} idle clients", idle.clients), &columns);
    for (name, before, after) in &idle.memory {
        let each_kib = (after - before) / idle.clients as f64 * 1024.0;
        table.push([name.clone().into(), (*before).into(), (*after).into(), each_kib.into()])?;
    }
    Ok(table)
}

impl Idle {
    /// Memory of each client on all servers, without the clients' own.
    pub(super) fn each_mib(&self) -> f64 {
        let servers = self.memory.iter().filter(|(name, ..)| name != "clients");
        servers.map(|(_, before, after)| after - before).sum::<f64>() / self.clients as f64
    }
}

fn steady(looks: &[(f64, f64)]) -> &[(f64, f64)] {
    &looks[(looks.len() as f64 * WARM_UP) as usize..]
}

/// The slope by least squares.
pub(super) fn slope_mib_per_s(looks: &[(f64, f64)]) -> f64 {
    let x = mean_of(looks, |look| look.0);
    let y = mean_of(looks, |look| look.1);
    let above: f64 = looks.iter().map(|look| (look.0 - x) * (look.1 - y)).sum();
    above / looks.iter().map(|look| (look.0 - x).powi(2)).sum::<f64>()
}

/// The growth of the process that gains most, over the whole load, as a share of its memory.
pub(super) fn growth(load: &Load) -> f64 {
    // The clients keep the times of every frame.
    let servers = load.memory.iter().filter(|(name, _)| name != "clients");
    let growths = servers.map(|(_, looks)| {
        let looks = steady(looks);
        slope_mib_per_s(looks) * load.clients.lasting.as_secs_f64() / mean_of(looks, |look| look.1)
    });
    growths.fold(f64::NAN, f64::max)
}

pub(super) fn memory_chart(load: &Load) -> XyChart {
    let x = Axis::linear("time", "s");
    let y = Axis::linear("resident memory", "MiB");
    let chart = XyChart::new(format!("Memory, {}", load.name), x, y);
    load.memory.iter().fold(chart, |chart, (name, looks)| chart.with(Series::line(name.clone(), looks.iter().copied())))
}
