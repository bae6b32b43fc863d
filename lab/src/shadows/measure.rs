//! Rows of the study: shadows of one scene and lamp by one sampling.

use depth_image::View;
use engine::{GpuEngine, LampSampling};
use report::{Picture, PictureRow, Point};
use sampling::SamplingMethod;

use super::errors::{ShadowErrors, share_picture};
use super::subject::{Answer, GRID_SIDE, LampBits, Subject};
use crate::study::measure_rows;

/// The samplings that are compared, by name; the second and third are non-redundant.
pub const SAMPLINGS: [&str; 4] = ["conventional", "non_redundant:pixel", "non_redundant:visibility", "depth_peeling:4"];
pub const SCENES: [&str; 4] = ["urban", "bird-nest", "tree", "grass"];

/// The side of images for which only shaders are built.
const WARM_UP_PX: u32 = 64;
/// Places along a side of the grid where only time is measured: it grows as the number of maps does.
const FEW_MAPS_SIDE: u32 = 4;
/// A layered cube with as many lines along its longest side as images have texels.
pub const CUBE: &str = "layered_cube";
/// Maps of the scene itself.
pub const OF_SCENE: &str = "maps of the scene";

/// A scene under a lamp, and the side of the lamp's images.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    pub scene: &'static str,
    pub lamp_size: f32,
    pub map_px: u32,
}

/// Shadows by samples.
#[derive(Debug, Clone)]
pub struct ShadowRow {
    pub setting: Setting,
    pub sampling: &'static str,
    /// Against shadow maps of the scene, and against rays.
    pub against_maps: ShadowErrors,
    pub against_rays: ShadowErrors,
    /// Seconds of the lamp's images and their quads, and of all shadow maps with what pixels see of them.
    pub images_s: f64,
    pub maps_s: f64,
}

/// Both truths of a setting.
#[derive(Debug, Clone)]
pub struct TruthRow {
    pub setting: Setting,
    pub triangles: usize,
    /// Shadow maps of the scene, against rays.
    pub maps_against_rays: ShadowErrors,
    pub maps_s: f64,
    pub rays_s: f64,
}

/// What is measured of some settings.
#[derive(Debug, Clone, Default)]
pub struct Shadows {
    pub truths: Vec<TruthRow>,
    pub rows: Vec<ShadowRow>,
    /// The share of the lamp that is seen, of scenes at the usual size.
    pub pictures: Vec<PictureRow>,
}

impl Shadows {
    pub fn find(&self, setting: Setting, sampling: &str) -> Option<&ShadowRow> {
        self.rows.iter().find(|row| row.setting == setting && row.sampling == sampling)
    }

    /// The error i against rays of a cube, over that of the best images.
    pub fn cube_ratio(&self, setting: Setting) -> Option<f64> {
        let of_images = SAMPLINGS.iter().filter_map(|sampling| self.find(setting, sampling));
        let best = of_images.map(|row| row.against_rays.intensity).min_by(f64::total_cmp)?;
        Some(self.find(setting, CUBE)?.against_rays.intensity / best)
    }

    /// The error i against shadow maps of the better non-redundant sampling.
    pub fn best_non_redundant(&self, setting: Setting) -> Option<f64> {
        let rows = SAMPLINGS[1..3].iter().filter_map(|sampling| self.find(setting, sampling));
        rows.map(|row| row.against_maps.intensity).min_by(f64::total_cmp)
    }
}

/// The parts of a run.
pub struct Measured {
    /// All scenes at the paper's size.
    pub scenes: Vec<Setting>,
    /// Sides of images (Table 3), sizes of lamps (Table 4), and times by number of triangles (Fig. 9).
    pub map_sides: Vec<Setting>,
    pub lamp_sizes: Vec<Setting>,
    pub times: Vec<TimeRow>,
    pub shadows: Shadows,
    /// Error against time of each scene.
    pub fronts: Vec<(&'static str, Vec<FrontRow>)>,
}

/// Measures settings by all samplings, in views of so many pixels a side.
///
/// # Errors
/// A scene cannot be used, or the device fails.
pub fn measure(
    engine: &GpuEngine,
    settings: &[Setting],
    pictured: &[Setting],
    view_px: u32,
) -> anyhow::Result<Shadows> {
    let mut shadows = Shadows::default();
    for measured in measure_rows("shadows", settings.iter().copied(), |setting| of_setting(engine, setting, view_px))? {
        if pictured.contains(&measured.truth.setting) {
            shadows.pictures.push(measured.picture_row());
        }
        shadows.truths.push(measured.truth);
        shadows.rows.extend(measured.rows);
    }
    Ok(shadows)
}

/// One setting with the bits of every answer, by name.
struct MeasuredSetting {
    truth: TruthRow,
    rows: Vec<ShadowRow>,
    view: View,
    bits: Vec<(&'static str, Vec<u32>)>,
}

impl MeasuredSetting {
    fn picture_row(&self) -> PictureRow {
        let scene = self.truth.setting.scene;
        let pictures = self.bits.iter().map(|(answer, words)| {
            Picture::new(format!("{scene} by {answer}"), (*answer).to_owned(), share_picture(words, &self.view))
        });
        let title = format!("{scene}: the share of the lamp that is seen (Figs 1 and 8)");
        PictureRow { title, pictures: pictures.collect() }
    }
}

fn of_setting(engine: &GpuEngine, setting: Setting, view_px: u32) -> anyhow::Result<MeasuredSetting> {
    let subject = Subject::load(engine, setting.scene, setting.lamp_size, view_px)?;
    let (view, _) = subject.view("unlit")?;
    let maps = warm_bits(&subject, Answer::Maps { side_px: setting.map_px }, GRID_SIDE)?;
    let rays = warm_bits(&subject, Answer::Rays, GRID_SIDE)?;
    let truth = TruthRow {
        setting,
        triangles: subject.triangles,
        maps_against_rays: ShadowErrors::of(&rays.words, &maps.words, &view),
        maps_s: maps.seconds,
        rays_s: rays.seconds,
    };
    let mut rows = Vec::new();
    let mut bits = vec![("rays", rays.words.clone()), (OF_SCENE, maps.words.clone())];
    for sampling in SAMPLINGS.into_iter().chain([CUBE]) {
        let sampled = sampled_bits(&subject, sampling, setting.map_px, GRID_SIDE)?;
        rows.push(ShadowRow {
            setting,
            sampling,
            against_maps: ShadowErrors::of(&maps.words, &sampled.bits.words, &view),
            against_rays: ShadowErrors::of(&rays.words, &sampled.bits.words, &view),
            images_s: sampled.images_s,
            maps_s: sampled.bits.seconds,
        });
        bits.push((sampling, sampled.bits.words));
    }
    Ok(MeasuredSetting { truth, rows, view, bits })
}

/// Bits, after a small run that builds shaders and trees.
fn warm_bits(subject: &Subject<'_>, answer: Answer, grid_side: u32) -> anyhow::Result<LampBits> {
    let small = match answer {
        Answer::Maps { .. } => Answer::Maps { side_px: WARM_UP_PX },
        other => other,
    };
    subject.bits(small, 1)?;
    subject.bits(answer, grid_side)
}

/// Bits by samples, and the time of the lamp's images with their quads.
struct SampledBits {
    bits: LampBits,
    images_s: f64,
}

fn answer_by(sampling: &str, side_px: u32) -> anyhow::Result<Answer> {
    if sampling == CUBE {
        return Ok(Answer::Cube { side: side_px });
    }
    let sampling = sampling.parse::<SamplingMethod>()?;
    Ok(Answer::Samples(LampSampling { sampling, side_px, ..LampSampling::default() }))
}

/// The first run of a single place takes the lamp's images, or the cube, too.
fn sampled_bits(subject: &Subject<'_>, sampling: &str, side_px: u32, grid_side: u32) -> anyhow::Result<SampledBits> {
    subject.bits(answer_by(sampling, WARM_UP_PX)?, 1)?;
    let answer = answer_by(sampling, side_px)?;
    let with_images = subject.bits(answer, 1)?;
    let without_images = subject.bits(answer, 1)?;
    let images_s = (with_images.seconds - without_images.seconds).max(0.0);
    Ok(SampledBits { bits: subject.bits(answer, grid_side)?, images_s })
}

/// The times of all steps on one scene.
#[derive(Debug, Clone)]
pub struct TimeRow {
    pub scene: &'static str,
    pub triangles: usize,
    pub answer: &'static str,
    pub images_s: f64,
    /// Of sixteen maps, with what pixels see of them.
    pub maps_s: f64,
}

impl TimeRow {
    pub fn point(&self) -> Point {
        (self.triangles as f64, self.images_s + self.maps_s).into()
    }
}

/// The times of a few maps of the scene, and of samples.
///
/// # Errors
/// A scene cannot be used, or the device fails.
pub fn times(engine: &GpuEngine, setting: Setting, view_px: u32) -> anyhow::Result<Vec<TimeRow>> {
    let subject = Subject::load(engine, setting.scene, setting.lamp_size, view_px)?;
    let triangles = subject.triangles;
    let maps = warm_bits(&subject, Answer::Maps { side_px: setting.map_px }, FEW_MAPS_SIDE)?;
    let scene = setting.scene;
    let mut rows = vec![TimeRow { scene, triangles, answer: OF_SCENE, images_s: 0.0, maps_s: maps.seconds }];
    for answer in ["conventional", "non_redundant:pixel", "depth_peeling:4", CUBE] {
        let sampled = sampled_bits(&subject, answer, setting.map_px, FEW_MAPS_SIDE)?;
        rows.push(TimeRow { scene, triangles, answer, images_s: sampled.images_s, maps_s: sampled.bits.seconds });
    }
    Ok(rows)
}

/// The view of a subject by rays that are spread over the lamp at random, against a grid by rays.
#[derive(Debug, Clone)]
pub struct FrontRow {
    pub name: String,
    pub answer: &'static str,
    pub seconds: f64,
    /// Mean difference of colours, of 255, from rays to 32×32 places, where a surface is shown.
    pub error: f64,
}

impl FrontRow {
    pub fn point(&self) -> Point {
        (self.seconds, self.error.max(1e-3)).into()
    }
}

/// Error against time: numbers of rays, maps and samples.
///
/// # Errors
/// The device fails.
pub fn front(engine: &GpuEngine, setting: Setting, view_px: u32, most_rays: u32) -> anyhow::Result<Vec<FrontRow>> {
    let subject = Subject::load(engine, setting.scene, setting.lamp_size, view_px)?;
    engine.set_lamp_sampling(LampSampling { side_px: setting.map_px, ..LampSampling::default() });
    let (truth, _) = subject.view("soft 32x32")?;
    // Shaders, the lamp's images and the cube.
    for lighting in ["soft 1", "soft 1x1 by maps", "soft 1x1 by samples", "soft 1x1 by cube"] {
        subject.view(lighting)?;
    }
    let numbers = std::iter::successors(Some(1_u32), |rays| Some(rays * 2)).take_while(|rays| *rays <= most_rays);
    let by_rays = numbers.map(|rays| ("rays", format!("soft {rays}")));
    let of_maps = ["maps", "samples", "cube"].map(|answer| (answer, format!("soft 16x16 by {answer}")));
    let rows: Vec<(&'static str, String)> = by_rays.chain(of_maps).collect();
    measure_rows("rays, maps, samples and cube", rows, |(answer, lighting)| {
        let (view, seconds) = subject.view(&lighting)?;
        Ok(FrontRow { name: lighting, answer, seconds, error: color_error(&truth, &view) })
    })
}

fn color_error(truth: &View, view: &View) -> f64 {
    let shown = truth.inverse_depth_per_m.as_deref().unwrap_or_default();
    let pixels =
        truth.srgb8.chunks_exact(3).zip(view.srgb8.chunks_exact(3)).zip(shown).filter(|(_, depth)| **depth > 0.0);
    let mut sum = 0.0;
    let mut count = 0_usize;
    for ((truth, view), _) in pixels {
        sum += truth.iter().zip(view).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>();
        count += 3;
    }
    sum / count.max(1) as f64
}
