//! All rows of one subject, direct drawing, and what the planner chooses.

use std::time::Instant;

use app_core::planning::Planning;
use coordinator::schedule::EqualNodes;
use depth_image::Antialias;
use planner::{Budget, Choice, Kept, Metric, Planner, Price, Pricing as _, ProbeView, Row};

use super::conditions::Conditions;
use super::order::order;
use super::row::{MeasuredRow, TIMED_VIEWS, time_again};
use super::subject::Subject;

/// Levels of the planner's budgets between the least and the greatest error of a subject's rows, in equal ratios.
const BUDGET_LEVELS: [f64; 3] = [0.2, 0.5, 0.8];
/// Seconds of measuring that a plan may take.
const ALLOWANCE_S: f64 = 120.0;
/// Samples a pixel of the rows of the front that are measured again.
const SAMPLES: u32 = 4;

/// How much is measured.
pub struct Limits {
    /// When measuring ends.
    pub end: Option<Instant>,
    pub views: Vec<ProbeView>,
    /// Numbers of sample cameras and sides of their images of the rows that are measured; `None`: all.
    pub only: Option<(&'static [u32], &'static [f64])>,
}

impl Limits {
    fn are_reached(&self) -> bool {
        self.end.is_some_and(|end| Instant::now() >= end)
    }

    /// Whether a row is to be measured.
    pub fn include(&self, row: &Row) -> bool {
        self.only.is_none_or(|(cameras, sides)| cameras.contains(&row.camera_count) && sides.contains(&row.side_ratio))
    }
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
    /// Rows of the front with four samples a pixel, and direct drawing with as many.
    pub antialiased: Vec<MeasuredRow>,
    pub antialiased_direct: Option<Price>,
    pub direct: Price,
    pub planned: Vec<Planned>,
    /// Rows that were left out for want of time.
    pub left_out: usize,
}

impl Front {
    /// Measures a subject, as far as the limits allow.
    ///
    /// # Errors
    /// The device fails.
    pub fn measure(
        subject: &Subject,
        planning: &Planning,
        limits: &Limits,
        mut done: impl FnMut(),
    ) -> anyhow::Result<Self> {
        let mut prober = subject.prober(planning);
        let pricing = subject.pricing(&mut prober, planning)?;
        let taken: Vec<usize> =
            (0..planning.ladder.rows().len()).filter(|&place| limits.include(&planning.ladder.rows()[place])).collect();
        let candidates: Vec<Row> = taken.iter().map(|&place| planning.ladder.rows()[place].clone()).collect();
        let cameras = planning.viewpoints.cameras(&limits.views);
        let mut rows = Vec::with_capacity(taken.len());
        for place in order(&candidates).into_iter().map(|place| taken[place]) {
            if limits.are_reached() {
                break;
            }
            let row = (place, &planning.ladder.rows()[place]);
            let representation = &planning.representations[place];
            rows.push(MeasuredRow::measure(&mut prober, row, representation, &cameras, &pricing)?);
            done();
        }
        rows.sort_by_key(|row| row.place);
        if limits.end.is_none() {
            let (of, cameras) = (&planning.representations[..], &planning.viewpoints.first(TIMED_VIEWS)[..]);
            time_again(&mut prober, &mut rows, (of, cameras), &pricing, &mut done)?;
        }
        let mut front = Self {
            conditions: subject.conditions.clone(),
            scene_hash: planning.subject.scene_hash.clone(),
            left_out: taken.len() - rows.len(),
            rows,
            antialiased: Vec::new(),
            antialiased_direct: None,
            direct: pricing.direct(),
            planned: Vec::new(),
        };
        if limits.end.is_none() {
            front.antialias(subject, limits)?;
            front.plan(subject, planning, pricing)?;
        }
        Ok(front)
    }

    /// The rows with an error below that of every cheaper one, the cheapest first.
    #[must_use]
    pub fn best(&self, metric: Metric) -> Vec<&MeasuredRow> {
        let mut by_price: Vec<&MeasuredRow> = self.rows.iter().collect();
        by_price.sort_by(|a, b| a.price.node_s.total_cmp(&b.price.node_s));
        let mut least = f64::INFINITY;
        by_price.retain(|row| {
            let is_less = row.error_ratio(metric) < least;
            least = least.min(row.error_ratio(metric));
            is_less
        });
        by_price
    }

    /// Measures the rows of the front again, with several samples a pixel.
    fn antialias(&mut self, subject: &Subject, limits: &Limits) -> anyhow::Result<()> {
        let antialias = Antialias::of(SAMPLES).unwrap_or_default();
        let planning = subject.planning(antialias, subject.conditions.seed)?;
        let mut prober = subject.prober(&planning);
        let pricing = subject.pricing(&mut prober, &planning)?;
        let places: Vec<usize> = self.best(Metric::Flip).iter().map(|row| row.place).collect();
        for place in places {
            let row = (place, &planning.ladder.rows()[place]);
            let of = &planning.representations[place];
            self.antialiased.push(MeasuredRow::measure(
                &mut prober,
                row,
                of,
                &planning.viewpoints.cameras(&limits.views),
                &pricing,
            )?);
        }
        self.antialiased_direct = Some(pricing.direct());
        Ok(())
    }

    /// Makes plans for budgets between the least and the greatest error of the rows.
    fn plan(&mut self, subject: &Subject, planning: &Planning, pricing: EqualNodes) -> anyhow::Result<()> {
        let errors = || self.rows.iter().map(|row| row.error_ratio(Metric::Flip));
        let (least, most) = (errors().fold(1.0, f64::min).max(1e-3), errors().fold(1e-3, f64::max));
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
    let (choice, price, spent_s) = (outcome.choice, outcome.price, planner.spent_s());
    Ok(Planned { budget, choice, name, price, error_ratio, spent_s })
}
