//! The rows of a report of `myriorama-lab study planner`.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context as _, ensure};
use app_core::exit::BadInput;
use report::{Cell, Point, Report, Table};

use crate::budgets::report::{COST, FOREGROUND_FLIP, RECONSTRUCTION, ROWS};

/// The most bytes of a report.
const MAX_BYTES: u64 = 64 << 20;
/// The name of all reconstruction methods together.
pub const ALL: &str = "all";

/// Cost and error of rows, by reconstruction method and for all together.
pub type Methods = BTreeMap<String, Vec<Point>>;

/// The rows of each subject.
///
/// # Errors
/// The file cannot be read, is too large, or is no report of fronts; the text names the file and the reason.
pub fn read(path: &Path) -> Result<BTreeMap<String, Methods>, BadInput> {
    subjects(path).map_err(|error| BadInput(format!("{}: {error}", path.display())))
}

fn subjects(path: &Path) -> anyhow::Result<BTreeMap<String, Methods>> {
    let bytes = fs::metadata(path)?.len();
    ensure!(bytes <= MAX_BYTES, "{bytes} bytes are over the limit of {MAX_BYTES}");
    let report: Report = serde_json::from_str(&fs::read_to_string(path)?)?;
    let mut subjects = BTreeMap::new();
    for table in &report.tables {
        if let Some(name) = table.name.strip_prefix(ROWS) {
            subjects.insert(name.to_owned(), methods(table)?);
        }
    }
    ensure!(!subjects.is_empty(), "no table of rows: it is no report of `study planner`");
    Ok(subjects)
}

fn methods(table: &Table) -> anyhow::Result<Methods> {
    table.validate()?;
    let [method, cost, error] = [place(table, RECONSTRUCTION)?, place(table, COST)?, place(table, FOREGROUND_FLIP)?];
    let mut methods = Methods::new();
    for row in &table.rows {
        // Direct drawing has no method, and no error.
        let (Cell::Text(method), Some(cost), Some(error)) = (&row[method], number(&row[cost]), number(&row[error]))
        else {
            continue;
        };
        if cost > 0.0 {
            for name in [ALL, method] {
                methods.entry(name.to_owned()).or_default().push((cost, error).into());
            }
        }
    }
    Ok(methods)
}

/// The place of a column in a table.
fn place(table: &Table, name: &str) -> anyhow::Result<usize> {
    let place = table.columns.iter().position(|column| column.name == name);
    place.with_context(|| format!("table {:?} has no column {name:?}", table.name))
}

fn number(cell: &Cell) -> Option<f64> {
    match cell {
        Cell::Number(number) => Some(*number),
        Cell::Integer(integer) => Some(*integer as f64),
        _ => None,
    }
}
