//! The order in which rows are measured, so that measuring may stop anywhere.

use planner::Row;

/// The golden ratio's fraction: its multiples fill the unit interval evenly at any count.
const STEP: f64 = 0.618_033_988_749_895;

/// Places of rows: first one of each method, with all sampling methods in turn; then the others, spread evenly.
pub fn order(rows: &[Row]) -> Vec<usize> {
    let mut order = Vec::with_capacity(rows.len());
    let samplings = distinct(rows.iter().map(|row| row.sampling.as_str()));
    for (place, method) in distinct(rows.iter().map(|row| row.method.as_str())).into_iter().enumerate() {
        let sampling = samplings[place % samplings.len()];
        order.extend(rows.iter().position(|row| row.method == method && row.sampling == sampling));
    }
    let mut others: Vec<usize> = (0..rows.len()).filter(|row| !order.contains(row)).collect();
    others.sort_by(|a, b| spread(*a).total_cmp(&spread(*b)));
    order.extend(others);
    order
}

fn spread(place: usize) -> f64 {
    (place as f64 * STEP).fract()
}

fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut found = Vec::new();
    for name in names {
        if !found.contains(&name) {
            found.push(name);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn all_rows_are_there_and_the_first_have_every_method() {
        let rows: Vec<Row> = (0..60)
            .map(|i| Row {
                sampling: format!("s{}", i / 20),
                method: format!("m{}", i % 5),
                camera_count: 1 + i as u32,
                place_count: 1,
                side_ratio: 1.0,
                kind: "k".to_owned(),
                rank: 0,
            })
            .collect();
        let order = order(&rows);
        assert_eq!(order.iter().copied().collect::<BTreeSet<_>>(), (0..60).collect());
        let of = |name: fn(&Row) -> &str| order[..5].iter().map(|&row| name(&rows[row])).collect::<BTreeSet<_>>().len();
        assert_eq!((of(|row| &row.method), of(|row| &row.sampling)), (5, 3));
        let early = order[5..20].iter().filter(|&&row| row < 30).count();
        assert!((5..=10).contains(&early), "{early} of 15 are in the first half");
    }
}
