//! Made-up scenes: errors and costs of rows from a seed.

use planner::{Budget, Demand, PlanRequest, Planner, Probe, Probed, Row, RowCosts, ViewErrors};

/// Numbers from a seed (SplitMix64).
#[derive(Debug, Clone)]
pub struct Random(pub u64);

impl Random {
    /// From 0 to below 1.
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Evenly spread over the logarithm.
    pub fn between(&mut self, least: f64, most: f64) -> f64 {
        least * (most / least).powf(self.unit())
    }

    /// A factor with this coefficient of variation, 1 in the mean: the sum of three exponential numbers at 0.58.
    pub fn factor(&mut self, variation: f64) -> f64 {
        let gamma: f64 = (0..3).map(|_| -(1.0 - self.unit()).ln() / 3.0).sum();
        1.0 + (gamma - 1.0) * variation * 3_f64.sqrt()
    }
}

/// The 49 rows of expensive light.
pub fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for density in [0.25, 0.5, 1.0] {
        for camera_count in [1, 2, 4] {
            let methods = ["light:draft", "light:fast", "light", "light:fine"].map(str::to_owned);
            rows.extend(methods.map(|method| Row::Samples { method, camera_count, density }));
        }
    }
    for density in [0.5, 1.0] {
        for camera_count in [1, 4] {
            let methods = ["carve", "mesh"].map(str::to_owned);
            rows.extend(methods.map(|method| Row::Samples { method, camera_count, density }));
        }
    }
    let direct = [16, 8, 4, 2, 1]
        .map(|part| Row::Direct { lighting: format!("soft {}", 16 / part), ray_ratio: 1.0 / f64::from(part) });
    rows.extend(direct);
    rows
}

/// A made-up scene.
pub struct Scene {
    pub rows: Vec<Row>,
    pub errors: Vec<f64>,
    pub costs: Vec<RowCosts>,
    /// The coefficient of variation of errors between views, and the most foreground of a view.
    variation: f64,
    most_foreground_ratio: f64,
    random: Random,
}

impl Scene {
    pub fn new(seed: u64) -> Self {
        let mut random = Random(seed);
        let rows = rows();
        let surfaces_s = random.between(0.05, 0.3);
        let light_s = random.between(0.2, 3.0);
        let scale = random.between(0.5, 2.0);
        let unknown_ratio = random.between(0.02, 0.3);
        let mut errors = Vec::new();
        let mut costs = Vec::new();
        for row in &rows {
            let noise = random.factor(0.08);
            let cost_noise = random.factor(0.05);
            let (error, cost) = match row {
                Row::Direct { ray_ratio, .. } => {
                    let error = if *ray_ratio == 1.0 { 0.0 } else { 0.03 * ray_ratio.powf(-0.4) };
                    (error, RowCosts { view_s: surfaces_s + light_s * ray_ratio, ..RowCosts::default() })
                }
                Row::Samples { method, camera_count, density } => {
                    let cameras = f64::from(*camera_count);
                    let (base, effort, finds_surfaces) = match method.as_str() {
                        "light:draft" => (0.08, 0.0, false),
                        "light:fast" => (0.05, 0.2, false),
                        "light" => (0.025, 0.7, false),
                        "light:fine" => (0.012, 1.0, false),
                        _ => (0.1, 0.0, true),
                    };
                    let error = base * cameras.powf(-0.2) * density.powf(-0.4);
                    let unknown_s = light_s * unknown_ratio * effort * cameras.powf(-0.3) * density.powf(-0.4);
                    let view_s = if finds_surfaces { 0.3 * surfaces_s } else { surfaces_s + unknown_s };
                    let sample_image_s = density * density * (surfaces_s + light_s);
                    (error, RowCosts { sample_image_s, load_set_s: 0.01 * density * cameras, view_s })
                }
            };
            errors.push(error * scale * noise);
            costs.push(RowCosts { view_s: cost.view_s * cost_noise, ..cost });
        }
        let variation = random.between(0.1, 0.5);
        let most_foreground_ratio = random.between(0.2, 1.0);
        Self { rows, errors, costs, variation, most_foreground_ratio, random }
    }

    /// A view of a row: whatever is hard for one row is about as hard for the others.
    fn view(&mut self, row: usize, difficulty: f64, foreground_ratio: f64) -> ViewErrors {
        let flip = (self.errors[row] * difficulty * self.random.factor(0.05)).clamp(0.0, 1.0);
        ViewErrors { foreground_ratio, flip, mean_square: flip * flip }
    }

    /// The answer to a probe.
    pub fn answer(&mut self, probe: &Probe) -> Probed {
        let views = probe.views.iter().map(|view| {
            let place = view.place(probe.id.plan);
            let mut random = Random((place.cell * 1e15) as u64);
            let difficulty = random.factor(self.variation);
            self.view(probe.row, difficulty, self.most_foreground_ratio * random.unit())
        });
        let views: Vec<ViewErrors> = views.collect();
        let own = self.costs[probe.row];
        let costs = RowCosts { view_s: own.view_s * self.random.factor(0.05), ..own };
        Probed { id: probe.id, views, costs, busy_s: own.view_s * probe.views.len() as f64 }
    }

    pub fn request(&self, budget: Budget, views_a_set: usize, number: u64) -> PlanRequest {
        let demand = Demand { nodes: 2, cells: 1, views_a_set };
        PlanRequest { number, budget, rows: self.rows.clone(), exact: Some(self.rows.len() - 1), demand }
    }

    /// A plan to its end.
    pub fn plan(&mut self, budget: Budget, views_a_set: usize, number: u64) -> Planner {
        let mut planner = Planner::new(self.request(budget, views_a_set, number)).unwrap();
        while let Some(probe) = planner.next_probe() {
            planner.answer(&self.answer(&probe)).unwrap();
        }
        planner
    }

    pub fn price_s(&self, row: usize, views_a_set: usize) -> f64 {
        Demand { nodes: 2, cells: 1, views_a_set }.price_s(&self.rows[row], &self.costs[row])
    }
}
