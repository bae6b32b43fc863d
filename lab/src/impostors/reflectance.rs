//! The light that each further mirror on a ray's way adds, by the mirrors' reflectance: in views by images, and drawn directly.

use anyhow::Context as _;
use depth_image::{Aabb, PinholeCamera, View, linear_from_srgb8};
use glam::Vec3;
use render::Lighting;
use sampling::Impostors;
use scene::{Limits, MissingTextures, Scene, SceneSpec};
use study::{Axis, Bar, Check, Series, XyChart};

use super::candidates::in_a_cluster;
use super::measure::{Hall, VIEW_PX, cells};
use super::orders;
use crate::failures::stand::Stand;
use crate::progress::bar;

/// Two mirror balls, and the reflectances that they are given.
const SCENE: &str = "mirror-hall";
const REFLECTANCES: [f32; 3] = [0.5, 0.7, 0.9];
const LIGHTING: &str = "shadows, reflections 8";
/// Mirrors on the way.
const ORDERS: u32 = 8;
/// Colours of eight bits do not show less.
const LEAST_LIGHT: f64 = 1e-5;
/// The fall from one mirror to the next: of views by images over that of directly drawn ones.
const BAR: Bar = Bar::AtMost(1.3);

/// The light that each mirror adds to a pixel, of all views and pixels the mean: by images, and drawn directly.
struct Added {
    ours: Vec<f64>,
    truth: Vec<f64>,
}

/// The chart, and how far apart the falls are where two mirrors face each other.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, impostors: Impostors) -> anyhow::Result<(XyChart, Check)> {
    let [x, y] = [Axis::linear("mirrors on the way", ""), Axis::log("light that the last one adds (linear)", "")];
    let mut chart = XyChart::new("Light by the number of mirrors that a ray meets", x, y);
    let progress = bar("reflectances", REFLECTANCES.len() + 1);
    let pair = added(stand, &load(orders::SCENE)?, &orders::views(), impostors)?;
    progress.inc(1);
    let apart = falls(&pair).map(|ratio| ratio.max(ratio.recip())).fold(f64::NAN, f64::max);
    chart = charted(chart, orders::SCENE, pair);
    for reflectance in REFLECTANCES {
        let views = [-0.5f32, 0.0, 0.5].map(|x_m| before(Vec3::new(x_m, 1.9, 3.8)));
        let light = added(stand, &hall_of(reflectance)?, &views, impostors)?;
        chart = charted(chart, &format!("{SCENE}, reflectance {reflectance}"), light);
        progress.inc(1);
    }
    progress.finish_and_clear();
    Ok((chart, Check::new("light of each further mirror, its fall apart from direct drawing's", apart, "×", BAR)))
}

fn charted(chart: XyChart, name: &str, Added { ours, truth }: Added) -> XyChart {
    [("by images", ours), ("direct", truth)].into_iter().fold(chart, |chart, (way, light)| {
        let points = (1..).map(f64::from).zip(light).filter(|(_, light)| *light > LEAST_LIGHT);
        chart.with(Series::line(format!("{name}, {way}"), points))
    })
}

/// The falls of one over those of the other, as long as both show light.
fn falls(Added { ours, truth }: &Added) -> impl Iterator<Item = f64> {
    let pairs = ours.windows(2).zip(truth.windows(2));
    let shows = |pair: &[f64]| pair.iter().all(|light| *light > LEAST_LIGHT);
    pairs.filter(move |(a, b)| shows(a) && shows(b)).map(|(a, b)| (a[1] / a[0]) / (b[1] / b[0]))
}

fn load(name: &str) -> anyhow::Result<Scene> {
    Ok(name.parse::<SceneSpec>()?.load(&Limits::default(), MissingTextures::Refuse)?)
}

fn hall_of(reflectance: f32) -> anyhow::Result<Scene> {
    let mut scene = load(SCENE)?;
    let mirror = scene.materials.last_mut().context("a mirror")?;
    mirror.base_color_linear = [reflectance, reflectance, reflectance, 1.0];
    Ok(scene)
}

fn added(stand: &Stand, scene: &Scene, views: &[PinholeCamera], impostors: Impostors) -> anyhow::Result<Added> {
    let lighting: Lighting = LIGHTING.parse()?;
    let hall = Hall::new(stand, scene, lighting, views)?;
    let (mirrors, _) = sampling::mirrors(scene, impostors);
    let bounds: Vec<Aabb> = mirrors.iter().map(|mirror| mirror.bounds).collect();
    let sets = mirrors.iter().map(|mirror| hall.set(&hall.images(&in_a_cluster(mirror))?, true));
    let sets = sets.collect::<anyhow::Result<Vec<_>>>()?;
    let cells = cells(&bounds, &sets);
    let (mut ours, mut truth) = (Vec::new(), Vec::new());
    for order in 0..=ORDERS {
        ours.push(hall.views(&cells, order)?);
        truth.push(hall.truths(order)?);
    }
    Ok(Added { ours: differences(&ours), truth: differences(&truth) })
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
