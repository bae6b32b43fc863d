//! Budgets as texts.

use planner::{Budget, BudgetError, Metric, Row, ViewErrors};

#[test]
fn budgets_survive_the_way_through_their_texts() {
    for (text, metric, most_ratio) in [
        ("flip 0.02", Metric::Flip, 0.02),
        ("flip 1", Metric::Flip, 1.0),
        ("psnr 30", Metric::Psnr, 1e-3),
        ("psnr 34.5", Metric::Psnr, 10_f64.powf(-3.45)),
    ] {
        let budget: Budget = text.parse().unwrap();
        assert_eq!((budget.metric(), budget.to_string()), (metric, text.to_owned()));
        assert!((budget.most_ratio() / most_ratio - 1.0).abs() < 1e-12, "{text}");
    }
    let spaced: Budget = "  flip   0.05 ".parse().unwrap();
    assert_eq!(spaced.to_string(), "flip 0.05");
    assert_eq!(spaced.shown(0.0123), "FLIP 0.0123");
    assert_eq!("psnr 30".parse::<Budget>().unwrap().shown(1e-3), "30.0 dB");
}

#[test]
fn texts_that_are_no_budget_are_refused_by_name() {
    let error = |text: &str| text.parse::<Budget>().unwrap_err();
    for text in ["flip 0", "flip -1", "flip 1.01", "flip NaN", "flip inf", "psnr 0", "psnr 101", "psnr NaN"] {
        assert!(matches!(error(text), BudgetError::OutOfRange { .. }), "{text}: {}", error(text));
    }
    for text in
        ["", "flip", "0.05", "flip 0.05 0.1", "ssim 0.9", "flip 5%", "flip 0.05dB", "psnr thirty", "flip p95 0.1"]
    {
        assert!(matches!(error(text), BudgetError::Malformed { .. }), "{text}: {}", error(text));
    }
    for text in ["flip 0.05, psnr 30", "flip 0.05, flip 0.1", ",", &"flip 0.1,".repeat(200)] {
        assert!(matches!(error(text), BudgetError::TwoLimits { .. }), "{text}: {}", error(text));
    }
    assert!(error(&"x".repeat(1 << 20)).to_string().len() < 200, "an error repeats no long text");
}

#[test]
fn errors_count_by_the_surface_that_views_show() {
    let budget: Budget = "flip 0.1".parse().unwrap();
    let view = |foreground_ratio: f64, flip: f64| ViewErrors { foreground_ratio, flip, mean_square: 0.0 };
    let views = [view(1.0, 0.05), view(0.1, 0.5), view(0.0, 0.0)];
    let mean = ViewErrors::mean_error(&views, &budget);
    assert!((mean - 0.1 / 1.1).abs() < 1e-12, "{mean}");
    let excess: f64 = views.iter().map(|view| view.excess(&budget)).sum();
    assert!((excess - (0.1 - 0.11)).abs() < 1e-12, "negative while the budget is kept: {excess}");
    assert_eq!(ViewErrors::mean_error(&[], &budget), 0.0);
    for (bad, field) in [
        (ViewErrors { flip: f64::NAN, ..ViewErrors::NONE }, "flip_ratio"),
        (ViewErrors { foreground_ratio: 1.1, ..ViewErrors::NONE }, "foreground_ratio"),
        (ViewErrors { mean_square: -0.1, ..ViewErrors::NONE }, "mean_square_ratio"),
    ] {
        assert_eq!(bad.validate().unwrap_err().field, field);
    }
}

#[test]
fn rows_with_impossible_values_are_refused_by_field() {
    let row = |camera_count: u32, density: f64| Row::Samples { method: "m".to_owned(), camera_count, density };
    assert!(row(4, 0.5).validate().is_ok());
    for (row, field) in [
        (row(0, 0.5), "camera_count"),
        (row(10, 0.5), "camera_count"),
        (row(1, f64::NAN), "density"),
        (row(1, 0.0), "density"),
        (Row::Samples { method: String::new(), camera_count: 1, density: 1.0 }, "method"),
        (Row::Direct { lighting: "x".repeat(300), ray_ratio: 1.0 }, "lighting"),
        (Row::Direct { lighting: "phong".to_owned(), ray_ratio: 2.0 }, "ray_ratio"),
    ] {
        assert_eq!(row.validate().unwrap_err().field, field, "{row:?}");
    }
}
