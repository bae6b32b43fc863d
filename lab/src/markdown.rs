//! Tables as Markdown.

use report::{Cell, Column, Table};

/// A table as Markdown, with numbers as in [`Cell::display`].
pub fn markdown(table: &Table) -> String {
    let heads = markdown_row(table.columns.iter().map(Column::heading));
    let rule = format!("|{}\n", "---|".repeat(table.columns.len()));
    let rows: String = table.rows.iter().map(|row| markdown_row(row.iter().map(Cell::display))).collect();
    format!("**{}**\n\n{heads}{rule}{rows}", table.name)
}

fn markdown_row(cells: impl Iterator<Item = String>) -> String {
    format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_read_as_markdown() {
        let mut table = Table::new("Times", &[("P", ""), ("T", "s")]);
        table.push([2_u32.into(), 1.5.into()]).unwrap();
        assert_eq!(markdown(&table), "**Times**\n\n| P | T (s) |\n|---|---|\n| 2 | 1.5 |\n");
    }
}
