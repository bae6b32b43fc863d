//! Predicted costs.

use planner::{CostModel, Row, RowCosts, TimedRow};

use crate::made_up::{Subject, ladder};
use crate::random::Random;

/// Powers of S and side that differ by method, as between methods that draw and those that follow rays.
fn known(row: &Row) -> RowCosts {
    let count = f64::from(row.camera_count);
    let draws = row.method.len().is_multiple_of(2);
    let constant = 2.0 + f64::from(row.rank) / 10.0 + row.sampling.len() as f64;
    let (by_count, by_side) = if draws { (0.8, 1.0) } else { (0.25, 0.0) };
    RowCosts {
        sample_image_s: 0.01 * constant.ln() * count.powf(-0.1) * row.side_ratio.powf(1.8),
        load_set_s: 0.002 * count.powf(1.1) * row.side_ratio.powf(2.2),
        reconstruct_view_s: 0.004 * count.powf(by_count) * row.side_ratio.powf(by_side),
    }
}

/// Errors of a prediction of the three costs, as shares of them.
fn off(model: &CostModel, row: &Row, costs: &RowCosts) -> [f64; 3] {
    let predicted = model.predict(row, 0.0);
    [
        predicted.sample_image_s / costs.sample_image_s,
        predicted.load_set_s / costs.load_set_s,
        predicted.reconstruct_view_s / costs.reconstruct_view_s,
    ]
    .map(|ratio| (ratio - 1.0).abs())
}

#[test]
fn powers_that_differ_by_method_are_found_between_the_measured_rows() {
    let ladder = ladder();
    let timed = ladder.rows().iter().map(|row| TimedRow { row: row.clone(), costs: known(row) });
    let model = CostModel::fit(&timed.collect::<Vec<_>>());
    for row in ladder.rows() {
        let between = Row { side_ratio: row.side_ratio.sqrt(), ..row.clone() };
        let errors = off(&model, &between, &known(&between));
        assert!(errors.iter().all(|&error| error < 0.05), "{between}: {errors:?}");
    }
}

/// Errors of c over the rows of 60 subjects that were not timed, as shares of it: the median and the 90th percentile; then
/// the share of rows that cost no less than one standard deviation below their prediction. `timed_count` rows are timed,
/// each the one of which least is known.
fn prediction_errors(timed_count: usize) -> [f64; 3] {
    let mut errors = Vec::new();
    let mut above = 0;
    for seed in 0..60 {
        let subject = Subject::new(seed);
        let rows = subject.ladder.rows();
        let mut timed: Vec<TimedRow> = Vec::new();
        for _ in 0..timed_count {
            let model = CostModel::fit(&timed);
            let uncertainty = |row: usize| model.uncertainty(&rows[row]);
            let next = (0..rows.len()).max_by(|&a, &b| uncertainty(a).total_cmp(&uncertainty(b))).expect("rows");
            timed.push(TimedRow { row: rows[next].clone(), costs: subject.costs[next] });
        }
        let model = CostModel::fit(&timed);
        let is_above =
            |row: usize| subject.costs[row].reconstruct_view_s >= model.predict(&rows[row], 1.0).reconstruct_view_s;
        let is_timed = |row: &Row| timed.iter().any(|timed| timed.row == *row);
        let others = || (0..rows.len()).filter(|&row| !is_timed(&rows[row]));
        above += others().filter(|&row| is_above(row)).count();
        errors.extend(others().map(|row| off(&model, &rows[row], &subject.costs[row])[2]));
    }
    errors.sort_by(f64::total_cmp);
    let [median, most] = [0.5, 0.9].map(|share| errors[(errors.len() as f64 * share) as usize]);
    [median, most, above as f64 / errors.len() as f64]
}

#[test]
fn more_timed_rows_predict_the_others_better() {
    let counts = [16, 30, 90];
    let errors = counts.map(prediction_errors);
    counts.iter().zip(&errors).for_each(|(count, errors)| {
        println!(
            "c from {count} rows: off by {:.3} (median), {:.3} (90 %); {:.3} above",
            errors[0], errors[1], errors[2]
        );
    });
    assert!(errors[0][0] <= 0.12 && errors[0][1] <= 0.30, "{errors:?}");
    assert!(errors.is_sorted_by(|a, b| a[0] > b[0] && a[1] > b[1]), "{errors:?}");
    // 84 % of a normal distribution are above one standard deviation below the mean. From many rows, the noise of a single
    // row is most of the error.
    assert!(errors.iter().all(|errors| errors[2] >= 0.75), "{errors:?}");
}

fn assert_finite(model: &CostModel, row: &Row) {
    for deviations in [0.0, 1.0] {
        let costs = model.predict(row, deviations);
        let all = [costs.sample_image_s, costs.load_set_s, costs.reconstruct_view_s];
        assert!(all.iter().all(|cost| cost.is_finite() && *cost > 0.0), "{costs:?}");
    }
    let uncertainty = model.uncertainty(row);
    assert!(uncertainty.is_finite() && uncertainty >= 0.0, "{uncertainty}");
}

#[test]
fn degenerate_measurements_give_finite_predictions() {
    let ladder = ladder();
    let row = &ladder.rows()[0];
    let costs = |cost: f64| RowCosts { sample_image_s: cost, load_set_s: cost, reconstruct_view_s: cost };
    let timed = |cost: f64| TimedRow { row: row.clone(), costs: costs(cost) };
    for set in [
        vec![],
        vec![timed(0.0)],
        vec![timed(f64::NAN), timed(f64::INFINITY)],
        vec![timed(1e-3); 50],
        vec![timed(1e300), timed(1e-300)],
        vec![TimedRow { row: Row { sampling: "unknown".to_owned(), ..row.clone() }, costs: costs(1.0) }],
    ] {
        let model = CostModel::fit(&set);
        ladder.rows().iter().for_each(|row| assert_finite(&model, row));
        assert_finite(&model, &Row { method: "new".to_owned(), side_ratio: 16.0, ..row.clone() });
    }
}

/// A cost that was measured says more about its own row than about rows of other methods.
#[test]
fn rows_of_measured_methods_are_less_uncertain() {
    let ladder = ladder();
    let rows = ladder.rows();
    let mut random = Random(1);
    let first = random.below(rows.len());
    let model = CostModel::fit(&[TimedRow { row: rows[first].clone(), costs: known(&rows[first]) }]);
    let own = model.uncertainty(&rows[first]);
    let others = rows.iter().filter(|row| row.method != rows[first].method);
    assert!(others.map(|row| model.uncertainty(row)).all(|other| other > 10.0 * own));
}
