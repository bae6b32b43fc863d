//! A report's files, read back.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use image::RgbImage;
use report::{
    Axis, Bar, Cell, Check, Limit, Outcome, Picture, PictureRow, Point, Report, ReportError, Series, Table, XyChart,
};

const HOSTILE: &str = "a<script>&\"b\"";

fn lines() -> XyChart {
    let mut chart = XyChart::new("cost over views", Axis::log("views", ""), Axis::log("time", "ms"))
        .with(Series::line("joint carve", [(1.0, 2.0), (10.0, 3.0)]).then_extrapolated([(100.0, 9.0)]))
        .with(Series::points(HOSTILE, [Point::labelled(2.0, 2.5, "S = 4")]));
    chart.limits.push(Limit { name: "budget".to_owned(), y: 5.0 });
    chart.staircase = vec![(1.0, 2.0).into()];
    chart
}

fn full_report() -> Report {
    let mut report = Report::new(HOSTILE, "llvmpipe");
    report.version("mesa", "25.2");
    report.parameter("views", 100_u32);
    report.parameter("scene", HOSTILE);
    let mut table = Table::new("costs", &[("what", ""), ("time", "ms")]);
    table.push([HOSTILE.into(), 1.5.into()]).unwrap();
    table.push(["none".into(), Cell::Missing]).unwrap();
    report.tables.push(table);
    report.checks = vec![
        Check::new("efficiency", 0.93, "", Bar::AtLeast(0.9)),
        Check::new("rate", f64::NAN, "%", Bar::AtMost(0.5)),
        Check::not_run("speed-up", "×", Bar::AtLeast(10.0), "no GPU"),
    ];
    report.charts = vec![lines()];
    report.cover = Some(Picture::new("first", "the cover", RgbImage::new(5, 2)));
    let picture = Picture::new("one", HOSTILE, RgbImage::new(4, 3));
    report.pictures = vec![PictureRow { title: "views".into(), pictures: vec![picture] }];
    report
}

fn written_folder(report: &Report) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    report.write(folder.path()).unwrap();
    folder
}

fn read(folder: &Path, file: &str) -> String {
    fs::read_to_string(folder.join(file)).unwrap()
}

#[test]
fn report_json_reads_back_as_it_was() {
    let report = full_report();
    let folder = written_folder(&report);
    let back: Report = serde_json::from_str(&read(folder.path(), "report.json")).unwrap();
    let mut without_pixels = report;
    let pictures = without_pixels.cover.iter_mut().chain(&mut without_pixels.pictures[0].pictures);
    pictures.for_each(|picture| picture.image = RgbImage::default());
    assert_eq!(back, without_pixels);
    assert_eq!(back.parameters.keys().collect::<Vec<_>>(), ["views", "scene"]);
}

#[test]
fn report_json_has_the_fields_that_the_format_names() {
    let folder = written_folder(&full_report());
    let json: serde_json::Value = serde_json::from_str(&read(folder.path(), "report.json")).unwrap();
    for field in ["schema", "title", "device", "versions", "parameters", "rows", "checks"] {
        assert!(!json[field].is_null(), "{field}");
    }
    for field in ["name", "value", "unit", "bar", "holds"] {
        assert!(json["checks"][0].get(field).is_some(), "{field}");
    }
    assert_eq!(json["checks"][1]["holds"], false);
    assert!(json["checks"][2]["holds"].is_null());
}

#[test]
fn strict_fails_only_what_falls_short() {
    let mut report = full_report();
    assert_eq!(
        report.checks.iter().map(Check::outcome).collect::<Vec<_>>(),
        [Outcome::Holds, Outcome::FallsShort, Outcome::NotRun]
    );
    assert!(!report.exit_ok());
    report.checks.remove(1);
    assert!(report.exit_ok(), "what was not run does not fall short");
}

#[test]
fn the_cover_is_the_first_picture_of_the_page() {
    let page = read(written_folder(&full_report()).path(), "index.html");
    let cover = page.find("pictures&#x2f;first.png").expect("a cover");
    assert!(cover < page.find("<h2>").expect("a heading"), "{page}");
}

#[test]
fn every_part_has_its_file() {
    let folder = written_folder(&full_report());
    for file in ["costs.csv", "charts/cost-over-views.svg", "pictures/one.png", "pictures/first.png"] {
        assert!(folder.path().join(file).is_file(), "{file}");
    }
    assert_eq!(image::open(folder.path().join("pictures/one.png")).unwrap().width(), 4);
    assert!(read(folder.path(), "costs.csv").ends_with("\nnone,\n"));
}

#[test]
fn charts_are_xml_that_names_their_series_axes_and_limits() {
    let folder = written_folder(&full_report());
    let svg = read(folder.path(), "charts/cost-over-views.svg");
    let document = roxmltree::Document::parse(&svg).unwrap();
    let texts: Vec<&str> = document
        .descendants()
        .filter(|node| node.has_tag_name("text"))
        .filter_map(|node| node.text())
        .map(str::trim)
        .collect();
    for word in ["cost over views", "joint carve", "joint carve, extrapolated", HOSTILE, "budget", "S = 4", "time (ms)"]
    {
        assert!(texts.contains(&word), "{word} is not in {texts:?}");
    }
}

#[test]
fn labels_do_not_cover_each_other_and_those_of_the_staircase_stay() {
    let points = |y| ["a", "b", "c"].map(|name| Point::labelled(5.0, y, format!("{name} at {y}")));
    let mut chart = XyChart::new("crowd", Axis::linear("x", ""), Axis::linear("y", ""))
        .with(Series::points("crowd", points(1.0).into_iter().chain(points(9.0))))
        .with(Series::points("front", [Point::labelled(5.0, 1.1, "on the front")]));
    chart.staircase = vec![(5.0, 1.1).into()];
    let svg = chart.to_svg().unwrap();
    for (label, is_drawn) in [("on the front", true), ("a at 1", false), ("a at 9", true), ("b at 9", false)] {
        assert_eq!(svg.contains(label), is_drawn, "{label}");
    }
}

#[test]
fn charts_without_points_are_drawn() {
    let empty = XyChart::new("empty", Axis::log("x", ""), Axis::linear("y", ""));
    let unplaceable = empty.clone().with(Series::line("zero", [(0.0, 1.0), (-1.0, f64::NAN), (f64::INFINITY, 2.0)]));
    let mut single = empty.clone().with(Series::line("one", [(5.0, 0.0)]));
    single.staircase = vec![(5.0, 0.0).into(), (0.0, f64::NAN).into()];
    for chart in [empty, unplaceable, single] {
        let mut report = Report::new("a chart", "none");
        report.charts.push(chart.clone());
        let folder = written_folder(&report);
        let svg = read(folder.path(), &format!("charts/{}.svg", chart.name));
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{}", chart.name);
        roxmltree::Document::parse(&svg).unwrap();
    }
}

#[test]
fn the_page_escapes_what_it_is_given_and_needs_nothing_from_outside() {
    let folder = written_folder(&full_report());
    let page = read(folder.path(), "index.html");
    assert!(!page.contains("<script") && page.contains("a&lt;script&gt;&amp;"));
    assert!(page.contains("<svg ") && page.contains("pictures&#x2f;one.png"));
    let outside = page.match_indices("http").filter(|(at, _)| !page[*at..].starts_with("http://www.w3.org/"));
    assert_eq!(outside.count(), 0);
}

#[test]
fn parts_that_do_not_fit_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let write = |change: fn(&mut Report)| {
        let mut report = full_report();
        change(&mut report);
        report.write(&folder.path().join("x")).unwrap_err()
    };
    let duplicate = write(|report| report.charts.push(XyChart { name: "Cost over views!".to_owned(), ..lines() }));
    assert!(matches!(duplicate, ReportError::DuplicateName { kind: "charts", .. }));
    let ragged = write(|report| report.tables[0].rows[0].truncate(1));
    assert!(matches!(ragged, ReportError::RowLength { row: 0, .. }));
    assert!(!folder.path().join("x").exists(), "nothing is written of a report that does not fit together");
}
