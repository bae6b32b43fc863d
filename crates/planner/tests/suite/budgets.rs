//! Budgets as texts, and the definition of y.

use planner::{Budget, BudgetError, Metric, Statistic, UnknownMetric, ViewErrors};

fn parse(text: &str) -> Result<Budget, BudgetError> {
    text.parse()
}

#[test]
fn budgets_are_read_and_printed() {
    for (text, metric, statistic, most_ratio, view_s) in [
        ("flip 0.05", Metric::Flip, Statistic::Mean, 0.05, None),
        ("flip whole 0.05", Metric::FlipWhole, Statistic::Mean, 0.05, None),
        ("flip p95 0.06", Metric::Flip, Statistic::P95, 0.06, None),
        ("flip whole p95 0.06", Metric::FlipWhole, Statistic::P95, 0.06, None),
        ("psnr 34", Metric::Psnr, Statistic::Mean, 10_f64.powf(-3.4), None),
        ("psnr p95 30", Metric::Psnr, Statistic::P95, 1e-3, None),
        ("disocclusion 0.5%", Metric::Disocclusion, Statistic::Mean, 0.005, None),
        ("flip p95 0.06, time 8ms", Metric::Flip, Statistic::P95, 0.06, Some(0.008)),
    ] {
        let budget = parse(text).unwrap();
        let term = budget.error().expect("an error term");
        assert_eq!((term.metric(), term.statistic()), (metric, statistic), "{text}");
        assert!((term.most_ratio() - most_ratio).abs() < 1e-15, "{text}");
        assert_eq!(budget.most_view_s(), view_s, "{text}");
        assert_eq!(budget.to_string(), text);
    }
    let time = parse("time 8ms").unwrap();
    assert_eq!((time.error(), time.most_view_s()), (None, Some(0.008)));
}

#[test]
fn other_spellings_give_the_same_budgets() {
    for (text, printed) in [
        ("  flip   5% ", "flip 0.05"),
        ("disocclusion 0.005", "disocclusion 0.5%"),
        ("time 0.5s,psnr 30", "psnr 30, time 500ms"),
        ("time 1e1ms", "time 10ms"),
    ] {
        assert_eq!(parse(text).unwrap().to_string(), printed);
        assert_eq!(parse(printed).unwrap(), parse(text).unwrap(), "{text}");
    }
}

#[test]
fn wrong_budgets_are_refused_by_their_term() {
    let long = vec!["flip 0.05"; 200].join(", ");
    for (text, expected) in [
        ("", "\"\" is no term of a budget"),
        ("flip", "\"flip\" is no term of a budget"),
        ("flip 0.05,", "\"\" is no term of a budget"),
        ("0.05", "\"0.05\" is no term of a budget"),
        ("p95 0.05", "\"p95 0.05\" is no term of a budget"),
        ("ssim 0.9", "\"ssim 0.9\": unknown metric \"ssim\", expected flip, flip whole, psnr or disocclusion"),
        ("wrong-hits 2%", "\"wrong-hits 2%\": unknown metric"),
        ("flip p90 0.05", "\"flip p90 0.05\": unknown metric"),
        ("flip 0.05 at 0.99", "\"flip 0.05 at 0.99\": unknown metric"),
        ("flip NaN", "\"flip NaN\": the limit must be above 0 and at most 1"),
        ("flip -0.1", "\"flip -0.1\": the limit must be above 0"),
        ("flip 0", "\"flip 0\": the limit must be above 0"),
        ("flip 1.01", "\"flip 1.01\": the limit must be above 0 and at most 1"),
        ("flip 101%", "\"flip 101%\": the limit must be above 0 and at most 100 %"),
        ("disocclusion 2", "\"disocclusion 2\": the limit must be above 0 and at most 1"),
        ("psnr inf", "\"psnr inf\": the limit must be above 0 and at most 100 dB"),
        ("psnr 3%", "\"psnr 3%\" is no term of a budget"),
        ("flip five", "\"flip five\" is no term of a budget"),
        ("time 8", "\"time 8\" is no term of a budget"),
        ("time 0ms", "\"time 0ms\": the limit must be above 0 and at most 60 s"),
        ("time 61s", "\"time 61s\": the limit must be above 0 and at most 60 s"),
        ("time p95 8ms", "\"time p95 8ms\" is no term of a budget"),
        ("flip 0.05, psnr 34", "\"psnr 34\": a budget has at most one error term"),
        ("time 8ms, time 9ms", "\"time 9ms\": a budget has at most one time term"),
        (&long, "\"flip 0.05\": a budget has at most one error term"),
    ] {
        let error = parse(text).expect_err(text).to_string();
        assert!(error.starts_with(expected), "{text:?}: {error}");
    }
}

#[test]
fn an_unknown_metric_is_an_error_of_its_own() {
    let unknown: UnknownMetric = "ssim".parse::<Metric>().unwrap_err();
    let expected = BudgetError::UnknownMetric { term: "ssim 1".to_owned(), source: unknown };
    assert_eq!(parse("ssim 1"), Err(expected));
    assert!(Metric::help().starts_with("flip: FLIP over the foreground"), "{}", Metric::help());
}

#[test]
fn errors_repeat_a_long_term_in_part() {
    let error = parse(&format!("flip {}", "9".repeat(1 << 20))).unwrap_err().to_string();
    assert!(error.len() < 200, "{error}");
    let error = parse(&format!("{} 0.1", "ß".repeat(1 << 20))).unwrap_err().to_string();
    assert!(error.len() < 400, "{error}");
}

#[test]
fn a_stricter_limit_implies_a_looser_one_of_its_kind() {
    let implies = |a: &str, b: &str| parse(a).unwrap().error().unwrap().implies(&parse(b).unwrap().error().unwrap());
    assert!(implies("flip 0.04", "flip 0.05") && implies("flip 0.05", "flip 0.05, time 1ms"));
    assert!(implies("psnr 35", "psnr 34") && !implies("psnr 34", "psnr 35"));
    for other in ["flip whole 0.05", "flip p95 0.05", "disocclusion 5%", "flip 0.039"] {
        assert!(!implies("flip 0.04", other), "{other}");
    }
}

fn view(foreground_ratio: f64, flip: f64) -> ViewErrors {
    ViewErrors {
        foreground_ratio,
        flip,
        flip_whole: flip * foreground_ratio,
        mean_square: flip * flip,
        disoccluded_ratio: 0.0,
    }
}

/// Two views of 10 % and of 100 % foreground: all foreground pixels together have the mean error (0.1·0.5 + 1·0.1)/1.1.
#[test]
fn y_is_0_in_the_mean_where_the_foreground_of_all_views_has_the_error_of_the_budget() {
    let views = [view(0.1, 0.5), view(1.0, 0.1)];
    let pooled = 0.15 / 1.1;
    let mean = |metric, limit| views.iter().map(|view| view.excess(metric, limit)).sum::<f64>() / 2.0;
    assert!(mean(Metric::Flip, pooled).abs() < 1e-15);
    assert!(mean(Metric::FlipWhole, 0.075).abs() < 1e-15, "(0.05 + 0.1) / 2");
    assert!((views[0].excess(Metric::Psnr, 0.2) - 0.1 * 0.05).abs() < 1e-15, "squares, over the foreground");
}

#[test]
fn views_without_foreground_count_in_the_mean_only() {
    let term = |text: &str| parse(text).unwrap().error().unwrap();
    let empty = view(0.009, 0.3);
    assert!(!empty.counts_for(&term("flip p95 0.1")));
    assert!(empty.counts_for(&term("flip 0.1")) && empty.counts_for(&term("flip whole p95 0.1")));
    assert!(view(0.01, 0.3).counts_for(&term("flip p95 0.1")));
}
