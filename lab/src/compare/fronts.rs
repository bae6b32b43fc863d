//! The rows of a report of `myriorama-lab study fronts`.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use app_core::exit::BadInput;
use report::{Cell, Point, Report, Table};

use crate::fronts::report::{COST, FOREGROUND_FLIP, RECONSTRUCTION, ROWS};

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
    let wrong = |reason: String| BadInput(format!("{}: {reason}", path.display()));
    let bytes = fs::metadata(path).map_err(|error| wrong(error.to_string()))?.len();
    if bytes > MAX_BYTES {
        return Err(wrong(format!("{bytes} bytes are over the limit of {MAX_BYTES}")));
    }
    let text = fs::read_to_string(path).map_err(|error| wrong(error.to_string()))?;
    let report: Report = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
    let subjects = report.tables.iter().filter_map(|table| Some((table.name.strip_prefix(ROWS)?.to_owned(), table)));
    let read: BTreeMap<String, Methods> =
        subjects.map(|(name, table)| Ok((name, methods(table).map_err(wrong)?))).collect::<Result<_, BadInput>>()?;
    if read.is_empty() {
        Err(wrong("no table of rows: it is no report of `study fronts`".to_owned()))
    } else {
        Ok(read)
    }
}

fn methods(table: &Table) -> Result<Methods, String> {
    table.validate().map_err(|error| error.to_string())?;
    let place = |name: &str| {
        let place = table.columns.iter().position(|column| column.name == name);
        place.ok_or_else(|| format!("table {:?} has no column {name:?}", table.name))
    };
    let [method, cost, error] = [place(RECONSTRUCTION)?, place(COST)?, place(FOREGROUND_FLIP)?];
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

fn number(cell: &Cell) -> Option<f64> {
    match cell {
        Cell::Number(number) => Some(*number),
        Cell::Integer(integer) => Some(*integer as f64),
        _ => None,
    }
}
