//! Paths of a report's files, relative to its folder, and file names from names.

use crate::chart::XyChart;
use crate::table::Table;

pub(crate) fn chart_path(chart: &XyChart) -> String {
    format!("charts/{}.svg", slug(&chart.name))
}

pub(crate) fn table_path(table: &Table) -> String {
    format!("{}.csv", slug(&table.name))
}

pub(crate) fn picture_path(name: &str) -> String {
    format!("pictures/{}.png", slug(name))
}

/// Lower-case letters, digits and single hyphens; `unnamed` where nothing else is left.
#[must_use]
pub fn slug(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let joined = words.collect::<Vec<_>>().join("-").to_ascii_lowercase();
    if joined.is_empty() { "unnamed".into() } else { joined }
}

#[cfg(test)]
mod tests {
    use super::slug;

    #[test]
    fn no_path_comes_out() {
        assert_eq!(slug("Cost per view (V = 100)"), "cost-per-view-v-100");
        assert_eq!(slug("../../etc/passwd"), "etc-passwd");
        assert_eq!(slug("∆"), "unnamed");
    }
}
