//! Reports of several parts, each measured by itself.

use app_core::progress::bar;
use clap::ValueEnum;
use report::{Bar, Check, Report, Table};

use crate::study::new_report;

/// The result of a part.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Section {
    /// The device; empty where the part does not know.
    pub(crate) device: String,
    /// Its tables.
    pub(crate) tables: Vec<Table>,
    /// Its checks.
    pub(crate) checks: Vec<Check>,
}

impl Section {
    /// The section of a part that failed: its one check falls short.
    fn failed(part: &str) -> Self {
        let check = Check::new(format!("{part}: measured to the end"), f64::NAN, "", Bar::AtLeast(1.0));
        Self { checks: vec![check], ..Self::default() }
    }
}

/// Measures these parts one after the other; all parts where none is named. A part that fails hides no other.
pub(crate) async fn measure_parts<P: ValueEnum>(
    only: &[P],
    measure: impl AsyncFn(&P) -> anyhow::Result<Section>,
) -> Vec<Section> {
    let parts = if only.is_empty() { P::value_variants() } else { only };
    let progress = bar("parts", parts.len());
    let mut sections = Vec::new();
    for part in parts {
        let name = part.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned());
        progress.set_message(name.clone());
        let section = measure(part).await.unwrap_or_else(|error| {
            tracing::warn!(part = name, error = format!("{error:#}"), "not measured");
            Section::failed(&name)
        });
        sections.push(section);
        progress.inc(1);
    }
    progress.finish_and_clear();
    sections
}

/// A report of this title about the device of the sections.
pub(crate) fn report(title: &str, sections: &[Section]) -> Report {
    let device = sections.iter().map(|section| section.device.as_str()).find(|device| !device.is_empty());
    new_report(title, device.unwrap_or_default())
}

/// Adds the sections to the report.
pub(crate) fn add(report: &mut Report, sections: Vec<Section>) {
    for section in sections {
        report.tables.extend(section.tables);
        report.checks.extend(section.checks);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
    enum Part {
        Good,
        Bad,
    }

    #[tokio::test]
    async fn a_part_that_fails_falls_short_and_hides_no_other() {
        let measure = async |part: &Part| match part {
            Part::Good => Ok(Section { device: "cpu".to_owned(), ..Section::default() }),
            Part::Bad => anyhow::bail!("no device"),
        };
        let sections = measure_parts(&[], measure).await;
        assert_eq!((sections.len(), sections[0].checks.len()), (2, 0));
        assert_eq!(sections[1].checks[0].name, "bad: measured to the end");
        assert_eq!(measure_parts(&[Part::Good], measure).await.len(), 1);
    }
}
