//! All rows of one subject, direct drawing, and what the planner chooses.

use app_core::planning::Planning;
use coordinator::schedule::EqualNodes;
use planner::{Budget, Choice, Kept, Ladder, Metric, Planner, Price, Pricing as _, ProbeView, Row};

use super::row::{MeasuredRow, time_again};
use super::subject::{Conditions, Subject};

/// Levels of the planner's budgets between the least and the greatest error of a subject's rows, in equal ratios.
const BUDGET_LEVELS: [f64; 3] = [0.2, 0.5, 0.8];
/// Seconds of measuring that a plan may take.
const ALLOWANCE_S: f64 = 120.0;

/// Numbers of sample cameras and sides of their images, of the rows of a quick run.
const QUICK_CAMERAS: [u32; 2] = [1, 4];
const QUICK_SIDES: [f64; 2] = [0.5, 1.0];

/// The rows that are measured, and the views that they are measured on.
pub struct Extent {
    pub views: Vec<ProbeView>,
    includes: fn(&Row) -> bool,
}

impl Extent {
    /// All rows and 32 views, or every second number of cameras and size, and 8 views.
    pub fn new(is_quick: bool) -> Self {
        match is_quick {
            true => Self { views: screening(8), includes: is_quick_row },
            false => Self { views: screening(32), includes: |_| true },
        }
    }

    /// Rows of four cameras with images of the whole side.
    #[cfg(test)]
    pub fn of_four_cameras(views: u32) -> Self {
        Self { views: screening(views), includes: |row| row.camera_count == 4 && row.side_ratio == 1.0 }
    }

    /// The places of the rows in the ladder.
    pub fn places(&self, ladder: &Ladder) -> Vec<usize> {
        (0..ladder.rows().len()).filter(|&place| (self.includes)(&ladder.rows()[place])).collect()
    }
}

fn is_quick_row(row: &Row) -> bool {
    QUICK_CAMERAS.contains(&row.camera_count) && QUICK_SIDES.contains(&row.side_ratio)
}

fn screening(count: u32) -> Vec<ProbeView> {
    (0..count).map(ProbeView::Screening).collect()
}

/// A plan that was made, with its budget.
pub struct Planned {
    pub budget: Budget,
    pub choice: Choice,
    /// The choice as users read it.
    pub name: String,
    pub price: Price,
    /// The FLIP of the foreground on the views of its certificate; 0 of direct drawing.
    pub error_ratio: f64,
    pub spent_s: f64,
}

/// A subject's rows.
pub struct Front {
    pub conditions: Conditions,
    pub scene_hash: String,
    /// In the order of the ladder.
    pub rows: Vec<MeasuredRow>,
    pub direct: Price,
    pub planned: Vec<Planned>,
}

impl Front {
    /// Measures a subject; calls `done` after each row, and after each time that it is timed again.
    ///
    /// # Errors
    /// The device fails.
    pub fn measure(
        subject: &Subject,
        planning: &Planning,
        extent: &Extent,
        mut done: impl FnMut(),
    ) -> anyhow::Result<Self> {
        let mut prober = subject.prober(planning);
        let pricing = subject.pricing(&mut prober, planning)?;
        let cameras = planning.viewpoints.cameras(&extent.views);
        let mut rows = Vec::new();
        for place in extent.places(&planning.ladder) {
            rows.push(MeasuredRow::measure(&mut prober, planning, place, &cameras, &pricing)?);
            done();
        }
        time_again(&mut prober, &mut rows, planning, &pricing, &mut done)?;
        let mut front = Self {
            conditions: subject.conditions,
            scene_hash: planning.subject.scene_hash.clone(),
            rows,
            direct: pricing.direct(),
            planned: Vec::new(),
        };
        front.plan(subject, planning, pricing)?;
        Ok(front)
    }

    /// Makes plans for budgets between the least and the greatest error of the rows.
    fn plan(&mut self, subject: &Subject, planning: &Planning, pricing: EqualNodes) -> anyhow::Result<()> {
        let errors: Vec<f64> = self.rows.iter().map(|row| row.error_ratio(Metric::Flip)).collect();
        let least = errors.iter().copied().fold(1.0, f64::min).max(1e-3);
        let most = errors.into_iter().fold(1e-3, f64::max);
        for level in BUDGET_LEVELS {
            let limit = least * (most / least).powf(level);
            let budget: Budget = format!("flip {limit:.3}").parse()?;
            self.planned.push(planned(subject, planning, pricing, budget)?);
        }
        Ok(())
    }
}

fn planned(subject: &Subject, planning: &Planning, pricing: EqualNodes, budget: Budget) -> anyhow::Result<Planned> {
    let request = planning.request(budget, "this device".to_owned(), pricing.views_a_set, ALLOWANCE_S);
    let mut planner = Planner::new(request, planning.ladder.clone(), pricing)?;
    let mut prober = subject.prober(planning);
    let nothing = Kept::empty(planning.key());
    let Planning { viewpoints, representations, .. } = planning;
    let (outcome, _) = probe::plan(&mut planner, &mut prober, viewpoints, representations, nothing, |_| ());
    let error_ratio = outcome.certificate.map_or(0.0, |certificate| certificate.expected_ratio);
    let name = match outcome.choice {
        Choice::Row(row) => planning.ladder.rows()[row].to_string(),
        Choice::Direct => "direct".to_owned(),
    };
    Ok(Planned { budget, choice: outcome.choice, name, price: outcome.price, error_ratio, spent_s: planner.spent_s() })
}
