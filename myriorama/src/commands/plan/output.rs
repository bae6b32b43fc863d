//! What a plan prints and writes.

use std::path::Path;

use anyhow::Context as _;
use app_core::camera_record::{self, NamedCamera};
use app_core::planning::Planning;
use app_core::print_line;
use app_core::setup::Setup;
use planner::{Budget, CHOICE_OF_BUDGETS, Choice, Metric, Outcome, Price, RowSummary};
use probe::Representation;
use report::{Cell, Table};
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
struct Line {
    name: String,
    state: String,
    error_ratio: Option<f64>,
    price: Price,
    is_measured: bool,
    views: usize,
}

impl Output<'_> {
    /// Prints the choice, its reason, the front and the flags; writes the files.
    pub(super) fn write(&self, rows: &[RowSummary], direct: Price) -> anyhow::Result<()> {
        let lines = self.lines(rows, direct);
        let out = self.out;
        std::fs::create_dir_all(out).with_context(|| format!("cannot create {}", out.display()))?;
        let csv = out.join("rows.csv");
        let all = self.table("all rows", lines.iter())?.to_csv()?;
        std::fs::write(&csv, all).with_context(|| format!("cannot write {}", csv.display()))?;
        print_line!("{}\n{CHOICE_OF_BUDGETS}\n", self.outcome.reason);
        print_line!("{}", self.table("Front of cost against error", front(&lines).into_iter())?.to_text());
        if let Choice::Row(row) = self.outcome.choice {
            let chosen = &self.planning.representations[row];
            let cameras = out.join("samples.json");
            self.write_cameras(&cameras, chosen)?;
            print_line!("\nThe flags that repeat it, for up, coordinator and demo:\n  {}", flags(chosen, &cameras));
        }
        Ok(())
    }

    /// All rows and direct drawing, the cheapest first.
    fn lines(&self, rows: &[RowSummary], direct: Price) -> Vec<Line> {
        let mut lines = Vec::with_capacity(rows.len() + 1);
        for (place, (row, summary)) in self.planning.ladder.rows().iter().zip(rows).enumerate() {
            let is_chosen = self.outcome.choice == Choice::Row(place);
            lines.push(Line {
                name: row.to_string(),
                state: if is_chosen { "chosen".to_owned() } else { summary.status.to_string() },
                error_ratio: summary.error_ratio,
                price: summary.price,
                is_measured: summary.is_measured,
                views: summary.screening_views,
            });
        }
        let is_chosen = self.outcome.choice == Choice::Direct;
        lines.push(Line {
            name: "direct".to_owned(),
            state: if is_chosen { "chosen" } else { "open" }.to_owned(),
            error_ratio: Some(0.0),
            price: direct,
            is_measured: true,
            views: 0,
        });
        lines.sort_by(|a, b| a.price.node_s.total_cmp(&b.price.node_s));
        lines
    }

    fn table<'a>(&self, name: &str, lines: impl Iterator<Item = &'a Line>) -> anyhow::Result<Table> {
        let error = match self.budget.error().map(|term| term.metric()) {
            None | Some(Metric::Flip) => "FLIP of the foreground",
            Some(Metric::FlipWhole) => "FLIP",
            Some(Metric::Psnr) => "mean squared error",
            Some(Metric::Disocclusion) => "disocclusion",
        };
        let columns = [
            ("representation", ""),
            ("state", ""),
            (error, ""),
            ("cost of a view", "ms"),
            ("time of a view", "ms"),
            ("costs are", ""),
            ("views", ""),
        ];
        let mut table = Table::new(name, &columns);
        for line in lines {
            table.push([
                Cell::from(line.name.clone()),
                line.state.clone().into(),
                line.error_ratio.unwrap_or(f64::NAN).into(),
                (line.price.node_s * 1e3).into(),
                (line.price.view_s * 1e3).into(),
                if line.is_measured { "measured" } else { "predicted" }.into(),
                line.views.into(),
            ])?;
        }
        Ok(table)
    }

    fn write_cameras(&self, path: &Path, chosen: &Representation) -> anyhow::Result<()> {
        let cameras = chosen.sample_cameras.iter().enumerate().map(|(index, camera)| NamedCamera {
            file_path: format!("sample_{index:04}.png"),
            camera: *camera.reference(),
            more: Map::new(),
        });
        Ok(camera_record::write(path, cameras, self.setup.offer.source_space, Map::new())?)
    }
}

/// The lines with an error below that of every cheaper one.
fn front(by_price: &[Line]) -> Vec<&Line> {
    let mut least = f64::INFINITY;
    let mut improves = |line: &&Line| {
        let is_less = line.error_ratio.is_some_and(|error| error < least);
        least = line.error_ratio.map_or(least, |error| error.min(least));
        is_less
    };
    by_price.iter().filter(&mut improves).collect()
}

fn flags(chosen: &Representation, cameras: &Path) -> String {
    let Representation { sampling, method, sample_cameras } = chosen;
    let size = sample_cameras
        .first()
        .map_or(String::new(), |camera| format!(" --sample-size {}x{}", camera.size_px().x, camera.size_px().y));
    format!("--sampling {sampling} --method {method}{size} --samples {}", cameras.display())
}
