//! Paths of a report's files, relative to its folder.

use crate::table::Table;

use crate::chart::Chart;
use crate::slug::slug;

pub(crate) fn chart_path(chart: &Chart) -> String {
    format!("charts/{}.svg", slug(chart.name()))
}

pub(crate) fn table_path(table: &Table) -> String {
    format!("{}.csv", slug(&table.name))
}

pub(crate) fn picture_path(name: &str) -> String {
    format!("pictures/{}.png", slug(name))
}
