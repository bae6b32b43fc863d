//! Ladders, and the relation by which rows are pruned.

use planner::{Ladder, MAX_ROWS, Row};

use crate::made_up::ladder;

fn row(kind: &str, camera_count: u32, side_ratio: f64, rank: u32) -> Row {
    let sampling = "plain".to_owned();
    let method = format!("{kind}:{rank}");
    Row { sampling, method, camera_count, place_count: camera_count, side_ratio, kind: kind.to_owned(), rank }
}

#[test]
fn a_row_is_dominated_by_one_of_its_kind_with_no_less_of_anything() {
    let best = row("search", 4, 0.71, 32);
    for (other, expected) in [
        (row("search", 4, 0.71, 32), true),
        (row("search", 2, 0.71, 32), true),
        (row("search", 2, 0.5, 8), true),
        (row("search", 8, 0.5, 8), false),
        (row("search", 2, 1.0, 8), false),
        (row("search", 2, 0.5, 64), false),
        (row("mesh", 2, 0.5, 8), false),
    ] {
        assert_eq!(other.is_dominated_by(&best), expected, "{other:?}");
    }
}

#[test]
fn impossible_ladders_are_refused_by_field() {
    let field = |rows| Ladder::new(rows).expect_err("an impossible ladder").field;
    assert_eq!(field(Vec::new()), "rows");
    assert_eq!(field((0..=MAX_ROWS as u32).map(|rank| row("search", 1, 1.0, rank)).collect()), "rows");
    assert_eq!(field(vec![row("search", 1, 1.0, 1), row("search", 1, 1.0, 1)]), "rows");
    assert_eq!(field(vec![row("search", 0, 1.0, 1)]), "camera_count");
    assert_eq!(field(vec![row("search", 65, 1.0, 1)]), "camera_count");
    for side_ratio in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
        assert_eq!(field(vec![row("search", 1, side_ratio, 1)]), "side_ratio");
    }
    assert_eq!(field(vec![row("", 1, 1.0, 1)]), "kind");
    assert_eq!(field(vec![Row { sampling: String::new(), ..row("search", 1, 1.0, 1) }]), "sampling");
    assert_eq!(field(vec![Row { method: "x".repeat(65), ..row("search", 1, 1.0, 1) }]), "method");
}

#[test]
fn a_ladder_of_all_rows_is_allowed() {
    assert_eq!(ladder().rows().len(), 3 * 4 * 3 * 6);
    assert!(Ladder::new((0..MAX_ROWS as u32).map(|rank| row("search", 1, 1.0, rank)).collect()).is_ok());
}
