//! How views change with each further mirror on a ray's way, by the mirrors' reflectance: views by images, and directly drawn ones.

use anyhow::Context as _;
use app_core::progress::bar;
use depth_image::{PinholeCamera, View, linear_from_srgb8};
use glam::Vec3;
use render::Lighting;
use report::{Axis, Bar, Check, Series, XyChart};
use sampling::Impostors;
use scene::{Limits, MissingTextures, Scene};

use super::measure::{Hall, VIEW_PX, cells};
use super::orders;
use crate::failures::stand::Stand;

/// Two mirror balls, and the reflectances that they are given.
const SCENE: &str = "mirror-hall";
const REFLECTANCES: [f32; 3] = [0.5, 0.7, 0.9];
const LIGHTING: &str = "shadows, reflections 8";
/// Mirrors on the way.
const ORDERS: u32 = 8;
/// Colours of eight bits do not show less.
const LEAST_CHANGE: f64 = 1e-5;
/// The fall from one mirror to the next: of views by images over that of directly drawn ones.
const BAR: Bar = Bar::AtMost(1.3);

/// How each mirror changes linear colours, of all views and pixels the mean of absolute values: by images, and drawn directly.
struct Changes {
    ours: Vec<f64>,
    truth: Vec<f64>,
}

/// The chart, and how far apart the falls are where two mirrors face each other.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, impostors: Impostors) -> anyhow::Result<(XyChart, Check)> {
    let [x, y] = [Axis::linear("mirrors on the way", ""), Axis::log("change by the last one, linear", "")];
    let mut chart = XyChart::new("Change of colours by the number of mirrors that a ray meets, in hard shadows", x, y);
    let progress = bar("reflectances", REFLECTANCES.len() + 1);
    let pair = changes(stand, &load(orders::SCENE)?, &orders::views(), impostors)?;
    progress.inc(1);
    let apart = falls(&pair).map(|ratio| ratio.max(ratio.recip())).fold(f64::NAN, f64::max);
    chart = charted(chart, orders::SCENE, pair);
    for reflectance in REFLECTANCES {
        let views = [-0.5f32, 0.0, 0.5].map(|x_m| before(Vec3::new(x_m, 1.9, 3.8)));
        let changes = changes(stand, &hall_of(reflectance)?, &views, impostors)?;
        chart = charted(chart, &format!("{SCENE}, reflectance {reflectance}"), changes);
        progress.inc(1);
    }
    progress.finish_and_clear();
    Ok((
        chart,
        Check::new("change by each further mirror: its fall, apart from that of direct drawing", apart, "×", BAR),
    ))
}

fn charted(chart: XyChart, name: &str, Changes { ours, truth }: Changes) -> XyChart {
    [("by images", ours), ("direct", truth)].into_iter().fold(chart, |chart, (way, changes)| {
        let points = (1..).map(f64::from).zip(changes).filter(|(_, change)| *change > LEAST_CHANGE);
        chart.with(Series::line(format!("{name}, {way}"), points))
    })
}

/// The falls of one over those of the other, as long as direct drawing shows a change.
fn falls(Changes { ours, truth }: &Changes) -> impl Iterator<Item = f64> {
    let pairs = ours.windows(2).zip(truth.windows(2));
    let shown = pairs.filter(|(_, truth)| truth.iter().all(|change| *change > LEAST_CHANGE));
    shown.map(|(ours, truth)| (ours[1] / ours[0]) / (truth[1] / truth[0]))
}

fn load(name: &str) -> anyhow::Result<Scene> {
    Ok(fixtures::spec(name)?.load(&Limits::default(), MissingTextures::Refuse)?)
}

fn hall_of(reflectance: f32) -> anyhow::Result<Scene> {
    let mut scene = load(SCENE)?;
    let mirror = scene.materials.last_mut().context("a mirror")?;
    mirror.base_color_linear = [reflectance, reflectance, reflectance, 1.0];
    Ok(scene)
}

fn changes(stand: &Stand, scene: &Scene, views: &[PinholeCamera], impostors: Impostors) -> anyhow::Result<Changes> {
    let lighting: Lighting = LIGHTING.parse()?;
    let hall = Hall::new(stand, scene, (lighting, 0), views)?;
    let (bounds, sets) = hall.surroundings(impostors)?;
    let cells = cells(&bounds, &sets);
    let (mut ours, mut truth) = (Vec::new(), Vec::new());
    for order in 0..=ORDERS {
        ours.push(hall.views(&cells, order)?);
        truth.push(hall.truths(order)?);
    }
    Ok(Changes { ours: differences(&ours), truth: differences(&truth) })
}

/// Of the views of each order from those of the order before.
fn differences(orders: &[Vec<View>]) -> Vec<f64> {
    let light = |views: &Vec<View>| -> Vec<f32> {
        views.iter().flat_map(|view| view.srgb8.iter().map(|code| linear_from_srgb8(*code))).collect()
    };
    let light: Vec<Vec<f32>> = orders.iter().map(light).collect();
    let apart = |before: &[f32], after: &[f32]| {
        let sum: f64 = before.iter().zip(after).map(|(before, after)| f64::from((after - before).abs())).sum();
        sum / after.len() as f64
    };
    light.windows(2).map(|pair| apart(&pair[0], &pair[1])).collect()
}

fn before(eye: Vec3) -> PinholeCamera {
    PinholeCamera::looking_at(eye, Vec3::new(0.0, 1.3, -2.0), Vec3::Y, 1.0, VIEW_PX)
}
