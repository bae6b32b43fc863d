//! A made-up subject: a ladder whose errors and costs are known exactly, and the caller of a planner.

use planner::{
    Command, Event, Kept, KeptKey, Ladder, Outcome, PlanRequest, Planner, Price, Pricing, ProbeView, Probed, Purpose,
    Row, RowCosts, Timed, ViewErrors,
};

use crate::random::Random;

/// The number of views that one sample set serves.
const VIEWS_PER_SET: f64 = 290.0;

const SAMPLINGS: [&str; 3] = ["plain", "thrifty", "peeled"];
const METHODS: [(&str, &str, u32); 6] = [
    ("search:8", "search", 8),
    ("search:32", "search", 32),
    ("carve:2", "carve", 2),
    ("carve:4", "carve", 4),
    ("quads", "quads", 1),
    ("boxes", "boxes", 1),
];

/// 3 sampling methods × S of {1, 2, 4, 8} × 3 sides × 6 reconstructions.
pub fn ladder() -> Ladder {
    let mut rows = Vec::new();
    for sampling in SAMPLINGS {
        for camera_count in [1, 2, 4, 8] {
            for side_ratio in [0.5, 0.71, 1.0] {
                rows.extend(METHODS.map(|(method, kind, rank)| Row {
                    sampling: sampling.to_owned(),
                    method: method.to_owned(),
                    camera_count,
                    place_count: camera_count,
                    side_ratio,
                    kind: format!("{sampling} {kind}"),
                    rank,
                }));
            }
        }
    }
    Ladder::new(rows).unwrap()
}

/// The mean errors and the costs of all rows, and how both vary.
#[derive(Debug, Clone)]
pub struct Subject {
    pub ladder: Ladder,
    seed: u64,
    /// Mean FLIP over the foreground of all views; other errors follow from it.
    pub flip: Vec<f64>,
    pub costs: Vec<RowCosts>,
    /// The coefficient of variation of FLIP between views.
    pub variation: f64,
    least_foreground: f64,
    /// The share of views that show next to nothing.
    pub empty_share: f64,
    /// The deviation of the logarithm of a cost from timing to timing.
    noise: f64,
    pub direct_s: f64,
}

impl Subject {
    pub fn new(seed: u64) -> Self {
        let mut random = Random(seed);
        let ladder = ladder();
        let variation = random.between(0.05, 0.6);
        let exponents = [random.between(0.2, 0.7), random.between(0.3, 1.0), random.between(0.0, 0.3)];
        let base = random.between(0.03, 0.08);
        let kinds: Vec<f64> = (0..16).map(|_| (0.3 * random.normal()).exp()).collect();
        let flip = ladder.rows().iter().map(|row| {
            let effort = f64::from(row.camera_count).powf(-exponents[0]) * row.side_ratio.powf(-exponents[1]);
            let kind = kinds[hash(&row.kind) % 16] * f64::from(row.rank).powf(-exponents[2]);
            (base * effort * kind * (0.08 * random.normal()).exp()).min(0.5)
        });
        let flip = flip.collect();
        let costs = costs(&ladder, &mut random);
        let direct_s = random.between(0.006, 0.06);
        let least_foreground = random.between(0.05, 0.8);
        Self { ladder, seed, flip, costs, variation, least_foreground, empty_share: 0.0, noise: 0.03, direct_s }
    }

    /// The errors of a row on a view: half of the variance is common to all rows.
    pub fn errors(&self, row: usize, view: ProbeView) -> ViewErrors {
        let number = match view {
            ProbeView::Screening(number) => u64::from(number) + (1 << 40),
            ProbeView::Fresh(number) => number,
        };
        let mut common = Random(self.seed ^ number.wrapping_mul(0x2545_f491_4f6c_dd1d));
        let mut own = Random(common.next() ^ (row as u64) << 32);
        let share = self.variation / 2.0_f64.sqrt();
        let is_empty = common.unit() < self.empty_share;
        let foreground_ratio = if is_empty { 0.005 } else { common.between(self.least_foreground, 1.0) };
        let flip = (self.flip[row] * common.gamma(share) * own.gamma(share)).min(1.0);
        ViewErrors {
            foreground_ratio,
            flip,
            flip_whole: flip * foreground_ratio,
            mean_square: (flip * 0.03).min(1.0),
            disoccluded_ratio: (flip * 0.1).min(1.0),
        }
    }

    /// The subject with another time of direct drawing.
    pub fn with_direct(self, direct_s: f64) -> Self {
        Self { direct_s, ..self }
    }

    pub fn price(&self, row: usize) -> Price {
        self.row(&self.ladder.rows()[row], &self.costs[row])
    }

    fn timed(&self, row: usize, place: u64, views: usize) -> RowCosts {
        let mut random = Random(self.seed.wrapping_add(place << 20) ^ row as u64);
        let deviation = self.noise / (views as f64 / 16.0).sqrt().max(1.0);
        let mut noisy = |cost: f64| cost * (deviation * random.normal()).exp();
        let RowCosts { sample_image_s, load_set_s, reconstruct_view_s } = self.costs[row];
        RowCosts {
            sample_image_s: noisy(sample_image_s),
            load_set_s: noisy(load_set_s),
            reconstruct_view_s: noisy(reconstruct_view_s),
        }
    }
}

impl Pricing for Subject {
    fn row(&self, row: &Row, costs: &RowCosts) -> Price {
        let set_s = f64::from(row.camera_count) * costs.sample_image_s + costs.load_set_s;
        let view_s = costs.reconstruct_view_s + 1e-4;
        Price { node_s: set_s / VIEWS_PER_SET + view_s, view_s }
    }

    fn direct(&self) -> Price {
        Price { node_s: self.direct_s, view_s: self.direct_s }
    }
}

/// Products of powers, each row 5 % off.
fn costs(ladder: &Ladder, random: &mut Random) -> Vec<RowCosts> {
    let constants: Vec<f64> = (0..16).map(|_| (0.4 * random.normal()).exp()).collect();
    let powers = [random.between(0.3, 0.7), random.between(0.1, 0.5)];
    let mut noisy = |cost: f64| cost * (0.05 * random.normal()).exp();
    let cost = |row: &Row| {
        let count = f64::from(row.camera_count);
        let side = row.side_ratio;
        let sampling = constants[hash(&row.sampling) % 16];
        let method = constants[hash(&row.method) % 16] * sampling.sqrt();
        RowCosts {
            sample_image_s: noisy(0.02 * side * side * sampling),
            load_set_s: noisy(0.002 * count * side * side * sampling),
            reconstruct_view_s: noisy(0.004 * count.powf(powers[0]) * side.powf(powers[1]) * method),
        }
    };
    ladder.rows().iter().map(cost).collect()
}

fn hash(text: &str) -> usize {
    text.bytes().fold(7_usize, |hash, byte| hash.wrapping_mul(31).wrapping_add(usize::from(byte)))
}

pub fn key() -> KeptKey {
    let [scene, cell, lighting, view_size, ladder_version] =
        ["scene", "cell", "light", "200x150", "1"].map(ToOwned::to_owned);
    KeptKey { scene, cell, lighting, view_size, ladder_version }
}

pub fn request(budget: &str, seed: u64) -> PlanRequest {
    PlanRequest {
        plan: 1,
        budget: budget.parse().unwrap(),
        key: key(),
        device: "made up".to_owned(),
        program_version: "1".to_owned(),
        pricing: "made up".to_owned(),
        allowance_s: 1e6,
        most_certified: 8,
        seed,
    }
}

pub fn planner(subject: &Subject, request: PlanRequest) -> Planner<Subject> {
    Planner::new(request, subject.ladder.clone(), subject.clone()).unwrap()
}

/// The events and the commands of a plan.
#[derive(Debug, Clone, Default)]
pub struct Run {
    pub events: Vec<Event>,
    pub commands: Vec<Command>,
}

impl Run {
    pub fn outcome(&self) -> Outcome {
        let concluded = self.commands.iter().find_map(|command| match command {
            Command::Conclude(outcome) => Some((**outcome).clone()),
            _ => None,
        });
        concluded.expect("an outcome")
    }

    pub fn kept(&self) -> Kept {
        let kept = self.commands.iter().find_map(|command| match command {
            Command::Keep(kept) => Some((**kept).clone()),
            _ => None,
        });
        kept.expect("kept measurements")
    }

    /// Rows and views that were measured for a purpose.
    pub fn probed(&self, of: Purpose) -> Vec<(usize, Vec<ProbeView>)> {
        let probes = self.commands.iter().filter_map(|command| match command {
            Command::Probe { row, views, purpose, .. } if *purpose == of => Some((*row, views.clone())),
            _ => None,
        });
        probes.collect()
    }
}

/// The answer to a command; `None` where it asks for nothing.
pub fn answer(subject: &Subject, command: &Command) -> Option<Event> {
    match command {
        Command::Probe { id, row, views, .. } => Some(Event::Probed(Probed {
            id: *id,
            row: *row,
            views: views.iter().map(|&view| (view, subject.errors(*row, view))).collect(),
            costs: subject.timed(*row, id.number, views.len()),
            busy_s: views.len() as f64 * (subject.price(*row).view_s + 0.01),
        })),
        Command::Time { id, rows, view_count, repeats } => Some(Event::Timed(Timed {
            id: *id,
            rows: rows.iter().map(|&row| (row, subject.timed(row, id.number, view_count * repeats))).collect(),
            busy_s: rows.len() as f64 * 0.5,
        })),
        Command::Keep(_) | Command::Conclude(_) => None,
        Command::Refuse(error) => panic!("{error}"),
    }
}

/// The nodes' time that an answer names, in s.
pub fn busy_s(event: &Event) -> f64 {
    match event {
        Event::Probed(probed) => probed.busy_s,
        Event::Timed(timed) => timed.busy_s,
        _ => 0.0,
    }
}

/// Executes a plan to its end.
pub fn run(planner: &mut Planner<Subject>, subject: &Subject, kept: Kept) -> Run {
    let mut run = Run::default();
    let mut next = Some(Event::Remembered(kept));
    while let Some(event) = next.take() {
        run.events.push(event.clone());
        let commands = planner.step(event);
        next = commands.iter().find_map(|command| answer(subject, command));
        run.commands.extend(commands);
        assert!(run.commands.len() < 5_000, "the plan ends");
    }
    run
}

/// A plan with nothing kept.
pub fn plan(subject: &Subject, budget: &str, seed: u64) -> Run {
    run(&mut planner(subject, request(budget, seed)), subject, Kept::empty(key()))
}
