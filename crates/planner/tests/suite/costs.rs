//! Predicted costs.

use planner::{CostModel, Row, RowCosts, TimedRow};

use crate::made_up::{Subject, VIEW_PIXELS, ladder};
use crate::random::Random;

const SIZES: [f64; 3] = [30_000.0, 120_000.0, 480_000.0];

/// Powers that the model has to find: of S, side and pixels.
fn known(row: &Row, view_pixels: f64) -> RowCosts {
    let (count, pixels) = (f64::from(row.camera_count), view_pixels / 1e5);
    let constant = 1.0 + f64::from(row.rank) / 10.0 + row.sampling.len() as f64;
    RowCosts {
        sample_image_s: 0.01 * constant.ln() * count.powf(-0.1) * row.side_ratio.powf(1.8) * pixels.powf(0.9),
        load_set_s: 0.002 * count.powf(1.1) * row.side_ratio.powf(2.2) * pixels.powf(0.8),
        reconstruct_view_s: 0.004 * count.powf(0.4) * row.side_ratio.powf(0.1) * pixels.powf(1.2),
    }
}

fn timed(rows: &[Row], view_pixels: f64) -> impl Iterator<Item = TimedRow> + '_ {
    rows.iter().map(move |row| TimedRow { row: row.clone(), view_pixels, costs: known(row, view_pixels) })
}

/// The exponent of a cost, from two predictions.
fn exponent(of: impl Fn(f64) -> f64, low: f64, high: f64) -> f64 {
    (of(high) / of(low)).ln() / (high / low).ln()
}

#[test]
fn known_exponents_are_recovered() {
    let ladder = ladder();
    let all: Vec<TimedRow> = SIZES.iter().flat_map(|&pixels| timed(ladder.rows(), pixels)).collect();
    let model = CostModel::fit(ladder.rows(), &all);
    let row = ladder.rows()[0].clone();
    let by_count = |count: f64| model.predict(&Row { camera_count: count as u32, ..row.clone() }, 1e5);
    let by_side = |side_ratio: f64| model.predict(&Row { side_ratio, ..row.clone() }, 1e5);
    let by_pixels = |pixels: f64| model.predict(&row, pixels);
    for (of, expected) in [
        ((|costs: RowCosts| costs.sample_image_s) as fn(RowCosts) -> f64, [-0.1, 1.8, 0.9]),
        (|costs| costs.load_set_s, [1.1, 2.2, 0.8]),
        (|costs| costs.reconstruct_view_s, [0.4, 0.1, 1.2]),
    ] {
        let found = [
            exponent(|count| of(by_count(count)), 1.0, 8.0),
            exponent(|side| of(by_side(side)), 0.5, 1.0),
            exponent(|pixels| of(by_pixels(pixels)), 3e4, 3e5),
        ];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 0.005, "{found} in place of {expected}");
        }
    }
}

/// Errors of c over all rows of 60 subjects, as shares of it: the median and the 90th percentile. `timed_count` rows are
/// timed, each the one of which least is known.
fn prediction_errors(timed_count: usize) -> [f64; 2] {
    let mut errors = Vec::new();
    for seed in 0..60 {
        let subject = Subject::new(seed);
        let rows = subject.ladder.rows();
        let mut timed: Vec<TimedRow> = Vec::new();
        for _ in 0..timed_count {
            let model = CostModel::fit(rows, &timed);
            let uncertainty = |row: usize| model.uncertainty(&rows[row], VIEW_PIXELS);
            let next = (0..rows.len()).max_by(|&a, &b| uncertainty(a).total_cmp(&uncertainty(b))).expect("rows");
            timed.push(TimedRow { row: rows[next].clone(), view_pixels: VIEW_PIXELS, costs: subject.costs[next] });
        }
        let model = CostModel::fit(rows, &timed);
        errors.extend(rows.iter().zip(&subject.costs).map(|(row, costs)| {
            let predicted = model.predict(row, VIEW_PIXELS).reconstruct_view_s;
            (predicted / costs.reconstruct_view_s - 1.0).abs()
        }));
    }
    errors.sort_by(f64::total_cmp);
    [0.5, 0.9].map(|share| errors[(errors.len() as f64 * share) as usize])
}

/// The ladder has ten unknowns: eight rows leave some to the prior.
#[test]
fn ten_timed_rows_predict_the_others() {
    let [eight, ten] = [8, 10].map(prediction_errors);
    println!("c predicted: median and 90 % error {eight:.3?} from eight rows, {ten:.3?} from ten");
    assert!(ten[0] <= 0.10 && ten[1] <= 0.25 && ten[1] < eight[1], "{eight:?} {ten:?}");
}

fn assert_finite(model: &CostModel, row: &Row, view_pixels: f64) {
    let costs = model.predict(row, view_pixels);
    let all = [costs.sample_image_s, costs.load_set_s, costs.reconstruct_view_s];
    assert!(all.iter().all(|cost| cost.is_finite() && *cost > 0.0), "{costs:?}");
    let uncertainty = model.uncertainty(row, view_pixels);
    assert!(uncertainty.is_finite() && uncertainty >= 0.0, "{uncertainty}");
}

#[test]
fn degenerate_measurements_give_finite_predictions() {
    let ladder = ladder();
    let row = &ladder.rows()[0];
    let costs = |cost: f64| RowCosts { sample_image_s: cost, load_set_s: cost, reconstruct_view_s: cost };
    let timed = |cost: f64, view_pixels: f64| TimedRow { row: row.clone(), view_pixels, costs: costs(cost) };
    for set in [
        vec![],
        vec![timed(0.0, 1.0)],
        vec![timed(f64::NAN, f64::NAN), timed(f64::INFINITY, -1.0)],
        vec![timed(1e-3, 3e4); 50],
        vec![timed(1e300, 1e300), timed(1e-300, 1e-300)],
        vec![TimedRow {
            row: Row { sampling: "unknown".to_owned(), ..row.clone() },
            view_pixels: 1.0,
            costs: costs(1.0),
        }],
    ] {
        let model = CostModel::fit(ladder.rows(), &set);
        ladder.rows().iter().for_each(|row| assert_finite(&model, row, VIEW_PIXELS));
        assert_finite(&model, &Row { method: "new".to_owned(), side_ratio: 1e300, ..row.clone() }, f64::INFINITY);
    }
}

/// A cost that was measured says more about its own row than about rows of other methods.
#[test]
fn rows_of_measured_methods_are_less_uncertain() {
    let ladder = ladder();
    let rows = ladder.rows();
    let mut random = Random(1);
    let first = random.below(rows.len());
    let timed =
        TimedRow { row: rows[first].clone(), view_pixels: VIEW_PIXELS, costs: known(&rows[first], VIEW_PIXELS) };
    let model = CostModel::fit(rows, &[timed]);
    let own = model.uncertainty(&rows[first], VIEW_PIXELS);
    let others = rows.iter().filter(|row| row.method != rows[first].method);
    assert!(others.map(|row| model.uncertainty(row, VIEW_PIXELS)).all(|other| other > 10.0 * own));
}
