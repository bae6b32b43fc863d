//! What a plan prints and writes.

use std::path::Path;

use anyhow::Context as _;
use app_core::camera_record::{self, NamedCamera};
use app_core::planning::Planning;
use app_core::print_line;
use app_core::setup::Setup;
use planner::{Budget, CHOICE_OF_BUDGETS, Choice, Metric, Outcome, Price, RowStatus, RowSummary};
use probe::Representation;
use report::Table;
use serde_json::Map;

/// A plan that is made.
pub(super) struct Output<'a> {
    pub(super) budget: Budget,
    /// The folder of the files.
    pub(super) out: &'a Path,
    pub(super) setup: &'a Setup,
    pub(super) planning: &'a Planning,
    pub(super) outcome: &'a Outcome,
}

/// A line of the table.
#[derive(Clone)]
struct Line {
    name: String,
    state: String,
    summary: RowSummary,
}

impl Output<'_> {
    /// Prints the choice, its reason, the front and the flags; writes the files.
    pub(super) fn write(&self, rows: &[RowSummary], direct: Price) -> anyhow::Result<()> {
        let lines = self.lines(rows, direct);
        let out = self.out;
        std::fs::create_dir_all(out).with_context(|| format!("cannot create {}", out.display()))?;
        let csv = out.join("rows.csv");
        let all = self.table("all rows", &lines).to_csv()?;
        std::fs::write(&csv, all).with_context(|| format!("cannot write {}", csv.display()))?;
        print_line!("{}\n{CHOICE_OF_BUDGETS}\n", self.outcome.reason);
        print_line!("{}", self.table("Front of cost against error", &front(&lines)).to_text());
        if let Choice::Row(row) = self.outcome.choice {
            let chosen = &self.planning.representations[row];
            let cameras = out.join("samples.json");
            let named = chosen.sample_cameras.iter().enumerate().map(|(index, camera)| NamedCamera {
                file_path: format!("sample_{index:04}.png"),
                camera: *camera.reference(),
                more: Map::new(),
            });
            camera_record::write(&cameras, named, self.setup.offer.source_space, Map::new())?;
            print_line!("\nThe flags that repeat it, for up, coordinator and demo:\n  {}", flags(chosen, &cameras));
        }
        Ok(())
    }

    /// All rows and direct drawing, the cheapest first.
    fn lines(&self, rows: &[RowSummary], direct: Price) -> Vec<Line> {
        let mut lines = Vec::with_capacity(rows.len() + 1);
        for (place, (row, summary)) in self.planning.ladder.rows().iter().zip(rows).enumerate() {
            let is_chosen = self.outcome.choice == Choice::Row(place);
            let state = if is_chosen { "chosen".to_owned() } else { summary.status.to_string() };
            lines.push(Line { name: row.to_string(), state, summary: *summary });
        }
        let is_chosen = self.outcome.choice == Choice::Direct;
        let summary = RowSummary {
            status: RowStatus::Open,
            screening_views: 0,
            error_ratio: Some(0.0),
            price: direct,
            is_measured: true,
        };
        let state = if is_chosen { "chosen" } else { "open" }.to_owned();
        lines.push(Line { name: "direct".to_owned(), state, summary });
        lines.sort_by(|a, b| a.summary.price.node_s.total_cmp(&b.summary.price.node_s));
        lines
    }

    fn table(&self, name: &str, lines: &[Line]) -> Table {
        let error = match self.budget.error().map(|term| term.metric()) {
            None | Some(Metric::Flip) => "FLIP of the foreground",
            Some(Metric::FlipWhole) => "FLIP",
            Some(Metric::Psnr) => "mean squared error",
            Some(Metric::Disocclusion) => "disocclusion",
        };
        Table::of_rows(
            name,
            lines,
            &[
                ("representation", "", |line| line.name.clone().into()),
                ("state", "", |line| line.state.clone().into()),
                (error, "", |line| line.summary.error_ratio.unwrap_or(f64::NAN).into()),
                ("cost of a view", "ms", |line| (line.summary.price.node_s * 1e3).into()),
                ("time of a view", "ms", |line| (line.summary.price.view_s * 1e3).into()),
                ("costs are", "", |line| if line.summary.is_measured { "measured" } else { "predicted" }.into()),
                ("views", "", |line| line.summary.screening_views.into()),
            ],
        )
    }
}

/// The lines with an error below that of every cheaper one.
fn front(by_price: &[Line]) -> Vec<Line> {
    let mut least = f64::INFINITY;
    let lines = by_price.iter().filter(|line| {
        let before = least;
        least = line.summary.error_ratio.map_or(least, |error| error.min(least));
        line.summary.error_ratio.is_some_and(|error| error < before)
    });
    lines.cloned().collect()
}

fn flags(chosen: &Representation, cameras: &Path) -> String {
    let Representation { sampling, method, sample_cameras } = chosen;
    let size = sample_cameras
        .first()
        .map_or(String::new(), |camera| format!(" --sample-size {}x{}", camera.size_px().x, camera.size_px().y));
    format!("--sampling {sampling} --method {method}{size} --samples {}", cameras.display())
}
