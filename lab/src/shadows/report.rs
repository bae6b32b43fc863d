//! Tables, charts and checks of the study.

use report::{Axis, Bar, Cell, Check, Mark, Report, Table, XyChart};

use super::measure::{FrontRow, Measured, OF_SCENE, SAMPLINGS, Setting, ShadowRow, Shadows, TimeRow, TruthRow};
use super::paper::{PaperRow, TABLE_3, TABLE_4, TABLE_5};
use crate::statistics::geometric_mean;
use crate::study::{Column, check_if_measured, table, with_series};

const NOT_MEASURED: &str = "it was not measured in this form";

const ERRORS: [Column<ShadowRow>; 14] = [
    Column::new("scene", |row| row.setting.scene.into()),
    Column::new("lamp", |row| row.setting.lamp_size.into()),
    Column::with_unit("images", "px", |row| row.setting.map_px.into()),
    Column::new("sampling", |row| row.sampling.into()),
    Column::new("i, maps", |row| row.against_maps.intensity.into()),
    Column::new("v, maps", |row| row.against_maps.visibility.into()),
    Column::new("signed, maps", |row| row.against_maps.signed.into()),
    Column::new("most, maps", |row| row.against_maps.most.into()),
    Column::new("i, rays", |row| row.against_rays.intensity.into()),
    Column::new("v, rays", |row| row.against_rays.visibility.into()),
    Column::new("signed, rays", |row| row.against_rays.signed.into()),
    Column::new("lit, rays", |row| row.against_rays.lit.into()),
    Column::new("penumbra, rays", |row| row.against_rays.penumbra.into()),
    Column::new("umbra, rays", |row| row.against_rays.umbra.into()),
];

const TRUTHS: [Column<TruthRow>; 9] = [
    Column::new("scene", |row| row.setting.scene.into()),
    Column::new("triangles", |row| row.triangles.into()),
    Column::new("lamp", |row| row.setting.lamp_size.into()),
    Column::with_unit("maps", "px", |row| row.setting.map_px.into()),
    Column::new("i, maps against rays", |row| row.maps_against_rays.intensity.into()),
    Column::new("v, maps against rays", |row| row.maps_against_rays.visibility.into()),
    Column::new("signed", |row| row.maps_against_rays.signed.into()),
    Column::with_unit("maps", "s", |row| row.maps_s.into()),
    Column::with_unit("rays", "s", |row| row.rays_s.into()),
];

const FRONT: [Column<FrontRow>; 3] = [
    Column::new("light", |row| row.name.as_str().into()),
    Column::with_unit("a view", "s", |row| row.seconds.into()),
    Column::new("colour error of 255", |row| row.error.into()),
];

const TIMES: [Column<TimeRow>; 5] = [
    Column::new("scene", |row| row.scene.into()),
    Column::new("triangles", |row| row.triangles.into()),
    Column::new("maps", |row| row.answer.into()),
    Column::with_unit("images and quads", "s", |row| row.images_s.into()),
    Column::with_unit("sixteen maps", "s", |row| row.maps_s.into()),
];

/// Adds everything to a report.
///
/// # Errors
/// A row does not fit its table.
pub fn report(measured: &Measured, report: &mut Report) -> anyhow::Result<()> {
    let shadows = &measured.shadows;
    report.tables.push(table("Shadows by samples", &ERRORS, &shadows.rows)?);
    report.tables.push(table("Shadow maps of the scene, and rays", &TRUTHS, &shadows.truths)?);
    report.tables.push(paper_table("Table 3: size of images", "images (px)", &TABLE_3, |row| {
        find(shadows, &measured.map_sides, |setting| setting.map_px as f32 == row.at && setting.scene == row.scene)
    })?);
    report.tables.push(paper_table("Table 4: size of the lamp", "lamp", &TABLE_4, |row| {
        find(shadows, &measured.lamp_sizes, |setting| setting.lamp_size == row.at && setting.scene == row.scene)
    })?);
    report.tables.push(times_table(measured)?);
    report.tables.push(table("Fig. 9: times of sixteen shadow maps", &TIMES, &measured.times)?);
    report.charts.push(triangles_chart(measured));
    for (scene, rows) in &measured.fronts {
        report.tables.push(table(format!("Error and time, {scene}"), &FRONT, rows)?);
        let chart = XyChart::new(
            format!("Soft shadows, {scene}"),
            Axis::log("a view", "s"),
            Axis::log("mean difference from rays to 32×32 places", "of 255"),
        );
        report.charts.push(with_series(chart, rows, Mark::Line, |row| row.answer.to_owned(), FrontRow::point));
    }
    report.pictures.extend(shadows.pictures.iter().cloned());
    report.checks.extend(checks(measured));
    report.summary = fronts_summary(measured);
    Ok(())
}

/// The rows of a setting, by sampling.
fn find(shadows: &Shadows, settings: &[Setting], is_wanted: impl Fn(&Setting) -> bool) -> Vec<ShadowRow> {
    let setting = settings.iter().find(|setting| is_wanted(setting));
    let rows = SAMPLINGS.iter().filter_map(|sampling| shadows.find(*setting?, sampling).cloned());
    rows.collect()
}

/// The paper's errors beside ours against shadow maps.
fn paper_table(
    name: &str,
    at: &str,
    paper: &[PaperRow],
    ours: impl Fn(&PaperRow) -> Vec<ShadowRow>,
) -> anyhow::Result<Table> {
    let columns = [
        ("scene", ""),
        (at, ""),
        ("paper, conventional", "i / v"),
        ("conventional", "i / v"),
        ("paper, non-redundant", "i / v"),
        ("pixel", "i / v"),
        ("visibility", "i / v"),
        ("paper, peeled", "i / v"),
        ("peeled", "i / v"),
    ];
    let mut table = Table::new(name, &columns);
    for row in paper {
        let own = ours(row);
        table.push([
            row.scene.into(),
            row.at.into(),
            pair(row.conventional).into(),
            errors_cell(&own, SAMPLINGS[0]),
            pair(row.non_redundant).into(),
            errors_cell(&own, SAMPLINGS[1]),
            errors_cell(&own, SAMPLINGS[2]),
            pair(row.peeled).into(),
            errors_cell(&own, SAMPLINGS[3]),
        ])?;
    }
    Ok(table)
}

fn errors_cell(rows: &[ShadowRow], sampling: &str) -> Cell {
    let row = rows.iter().find(|row| row.sampling == sampling);
    row.map_or_else(|| "–".into(), |row| pair([row.against_maps.intensity, row.against_maps.visibility]).into())
}

fn pair([intensity, visibility]: [f64; 2]) -> String {
    format!("{intensity:.2} / {visibility:.2}")
}

/// Table 5: images with their quads, and maps.
fn times_table(measured: &Measured) -> anyhow::Result<Table> {
    let columns = [
        ("scene", ""),
        ("sampling", ""),
        ("paper, images and quads", "ms"),
        ("images and quads", "ms"),
        ("paper, maps", "ms"),
        ("maps", "ms"),
    ];
    let mut table = Table::new("Table 5: times", &columns);
    // The paper has one non-redundant sampling, by pixel.
    let samplings = [("non_redundant:pixel", 0), ("conventional", 1), ("depth_peeling:4", 2)];
    for &setting in &measured.scenes {
        let paper = TABLE_5.iter().find(|(scene, _)| *scene == setting.scene);
        for (sampling, column) in samplings {
            let row = measured.shadows.find(setting, sampling);
            table.push([
                setting.scene.into(),
                sampling.into(),
                paper.map(|(_, times)| times[column][0]).into(),
                row.map(|row| row.images_s * 1e3).into(),
                paper.map(|(_, times)| times[column][1]).into(),
                row.map(|row| row.maps_s * 1e3).into(),
            ])?;
        }
    }
    Ok(table)
}

/// Fig. 9: the time of all steps over the number of triangles.
fn triangles_chart(measured: &Measured) -> XyChart {
    let chart = XyChart::new("Fig. 9: time of sixteen shadow maps", Axis::log("triangles", ""), Axis::log("time", "s"));
    with_series(chart, &measured.times, Mark::Line, |row| row.answer.to_owned(), TimeRow::point)
}

fn checks(measured: &Measured) -> Vec<Check> {
    let shadows = &measured.shadows;
    let ratios: Vec<f64> =
        measured.scenes.iter().filter_map(|&setting| non_redundant_ratio(shadows, setting)).collect();
    let most = ratios.iter().copied().fold(f64::NAN, f64::max);
    let all_scenes = ratios.len() == 4;
    let mut checks = vec![
        check_if_measured(
            "i against maps, the better non-redundant sampling over conventional, mean",
            all_scenes.then(|| ratios.iter().sum::<f64>() / ratios.len() as f64),
            "×",
            Bar::AtMost(0.8),
            NOT_MEASURED,
        ),
        check_if_measured("the same, worst scene", all_scenes.then_some(most), "×", Bar::AtMost(0.95), NOT_MEASURED),
    ];
    for lamp_size in [1.0, 2.0, 4.0] {
        let setting = measured.lamp_sizes.iter().find(|at| at.scene == "urban" && at.lamp_size == lamp_size);
        let ratio = setting.and_then(|&setting| {
            let peeled = shadows.find(setting, SAMPLINGS[3])?.against_maps.intensity;
            Some(shadows.best_non_redundant(setting)? / peeled)
        });
        let name = format!("i against maps, urban, lamp {lamp_size}, non-redundant over peeled");
        checks.push(check_if_measured(name, ratio, "×", Bar::AtMost(0.95), NOT_MEASURED));
    }
    let rising = rising_with_sides(measured);
    checks.push(Check::new(
        "v against rays that rises with the size of images, cases",
        rising as f64,
        "",
        Bar::Equal(0.0),
    ));
    for (scene, most) in [("grass:36", 1.0), ("grass:144", 0.25)] {
        let samples_s = maps_s(measured, scene, "non_redundant:pixel");
        let scene_s = maps_s(measured, scene, OF_SCENE);
        let ratio = samples_s.zip(scene_s).map(|(samples_s, scene_s)| samples_s / scene_s);
        let name = format!("time of maps from samples over maps of the scene, {scene}");
        checks.push(check_if_measured(name, ratio, "×", Bar::AtMost(most), NOT_MEASURED));
    }
    let cubes = measured.scenes.iter().filter_map(|&setting| shadows.cube_ratio(setting)).fold(f64::NAN, f64::max);
    let name = "i against rays, a layered cube over the best images, worst scene";
    checks.push(check_if_measured(name, all_scenes.then_some(cubes), "×", Bar::AtMost(0.75), NOT_MEASURED));
    checks
}

fn maps_s(measured: &Measured, scene: &str, answer: &str) -> Option<f64> {
    measured.times.iter().find(|row| row.scene == scene && row.answer == answer).map(|row| row.maps_s)
}

fn non_redundant_ratio(shadows: &Shadows, setting: Setting) -> Option<f64> {
    let conventional = shadows.find(setting, SAMPLINGS[0])?.against_maps.intensity;
    Some(shadows.best_non_redundant(setting)? / conventional)
}

/// Samplings and scenes of Table 3 whose larger images have a larger error v against rays.
fn rising_with_sides(measured: &Measured) -> usize {
    let steps = measured.map_sides.windows(2).filter(|pair| pair[0].scene == pair[1].scene);
    let cases = steps
        .flat_map(|pair| SAMPLINGS.map(|sampling| [pair[0], pair[1]].map(|at| measured.shadows.find(at, sampling))));
    let rises = cases.filter(|case| {
        let [small, large] = case.map(|row| row.map_or(f64::NAN, |row| row.against_rays.visibility));
        large > small
    });
    rises.count()
}

/// Which answer is better in the time that samples take.
fn fronts_summary(measured: &Measured) -> String {
    let sentences = measured.fronts.iter().filter_map(|(scene, rows)| {
        let samples = rows.iter().find(|row| row.answer == "samples")?;
        let rays = rows.iter().filter(|row| row.answer == "rays");
        let better = rays.clone().find(|row| row.error <= samples.error)?;
        Some(format!(
            "{scene}: {} has less error than samples ({:.2}, not {:.2}) in {:.2} of their time.",
            better.name,
            better.error,
            samples.error,
            better.seconds / samples.seconds
        ))
    });
    let ratios: Vec<f64> =
        measured.scenes.iter().filter_map(|&setting| non_redundant_ratio(&measured.shadows, setting)).collect();
    let mean = geometric_mean(&ratios)
        .map_or_else(String::new, |mean| format!("i of non-redundant over conventional samples: {mean:.2}. "));
    mean + &sentences.collect::<Vec<_>>().join(" ")
}
