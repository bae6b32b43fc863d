//! The browser's still of shared light before direct drawing replaces it, beside a picture drawn directly with many rays.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context as _;
use app_core::exit::BadInput;
use app_core::setup::{SceneArgs, Setup};
use codec::{DecodeLimits, FrameCodec, decode_frame, encode_frame};
use coordinator::SceneOffer;
use depth_image::{Antialias, PinholeCamera, View, ViewPlanes};
use engine::GpuEngine;
use glam::{DVec3, UVec2, Vec3};
use metrics::{PictureErrors, Rgb8Image};
use node::{DirectWork, Engine as _, Turn, WorkClass};
use report::{Bar, Cell, Check, Table};
use scene::SceneSpec;
use serde::Deserialize;

use super::page::Page;
use super::stand::Ground;
use crate::load::processes::{Processes, Setting};
use crate::models::models_of;
use crate::process::Process;
use crate::section::Section;

/// File stems of the models.
const MODELS: [&str; 5] = ["FlightHelmet", "lamborghini", "ingenuity", "threejs-shaderball", "spot"];
const SIZE_PX: [u32; 2] = [1280, 720];
/// Turns from the first camera to the poses, as shares of a full turn.
const TURNS: [f64; 2] = [0.0, 0.3];
const REFERENCE_LIGHTING: &str = "soft 64, occlusion 64";
const MAX_FLIP: f64 = 0.02;
const WITHIN: Duration = Duration::from_secs(300);
/// Keeps the picture of a pose that has all samples and fine light, once it is painted.
const CAPTURE: &str = "window.captured = null;
    const look = () => {
        const last = myriorama.statistics.pictures.at(-1)?.header;
        const isNewest = last?.still && last.number === myriorama.number();
        if (!isNewest || last.samples !== 16 || last.quality !== 'fine') return requestAnimationFrame(look);
        document.getElementById('picture').toBlob(async (blob) => {
            const png = [...new Uint8Array(await blob.arrayBuffer())];
            window.captured = { png, size_px: last.size_px, camera: last.camera, ms: last.times_ms.reconstruct };
        });
    };
    look();
    return null;";

/// A still as the browser shows it.
#[derive(Debug, Deserialize)]
struct Captured {
    png: Vec<u8>,
    size_px: [u32; 2],
    camera: StillCamera,
    /// The time on the device.
    ms: f64,
}

/// The camera of a picture, in the coordinates of the scene's file.
#[derive(Debug, Clone, Copy, Deserialize)]
struct StillCamera {
    eye: [f64; 3],
    target: [f64; 3],
    fov_y_deg: f64,
}

/// # Errors
/// A process does not start, a model is missing, or no picture comes.
pub(super) async fn measure(ground: &Ground) -> anyhow::Result<Section> {
    let mut table = Table::new(
        "Stills of shared light, 1280×720, 16 samples a pixel, against direct drawing with soft 64, occlusion 64",
        &[("model", ""), ("pose", ""), ("foreground FLIP", ""), ("foreground PSNR", "dB"), ("time", "s")],
    );
    let mut section = Section::default();
    let Some(folder) = &ground.models else {
        let check = Check::not_run("stills of shared light: FLIP", "", Bar::AtMost(MAX_FLIP), "--models is not given");
        section.checks.push(check);
        return Ok(section);
    };
    let models = models_of(folder, usize::MAX)?;
    for name in MODELS {
        let model = models.iter().find(|model| model.file_stem().is_some_and(|stem| stem == name));
        let missing = || BadInput(format!("{}: no model {name}", folder.display()));
        let model = model.with_context(missing)?;
        let (stills, device) = stills_of(ground, &model.display().to_string()).await.context(name)?;
        let reference = Reference::new(ground, model.clone())?;
        for (pose, still) in stills.iter().enumerate() {
            let foreground = reference.errors(still, &ground.out.join(format!("{name}-{pose}")))?;
            let figures = [foreground.flip, foreground.psnr_db, still.ms / 1000.0].map(Cell::from);
            table.push([Cell::from(name), Cell::from(pose)].into_iter().chain(figures))?;
            let check = format!("still of {name}, pose {pose}: foreground FLIP");
            section.checks.push(Check::new(check, foreground.flip, "", Bar::AtMost(MAX_FLIP)));
        }
        section.device = device;
    }
    section.tables.push(table);
    Ok(section)
}

/// The stills of a model's poses, and the name of the device.
async fn stills_of(ground: &Ground, model: &str) -> anyhow::Result<(Vec<Captured>, String)> {
    let scene = ["--scene", model, "--lighting", &ground.lighting.to_string()].map(str::to_owned).to_vec();
    let setting = Setting { scene, device: ground.device, nodes: 2, share_cores: None };
    let processes = Processes::start(&setting).await?;
    let fixed = ["--listen", "127.0.0.1:0", "--policy", "pipeline", "--exposure", "0", "--tone-map", "none"];
    let mut gateway = Process::gateway(&[&["--coordinator", &processes.address], &fixed[..]].concat())?;
    let page = Page::start(SIZE_PX).await?;
    page.open(&gateway.address()?).await?;
    page.browser.wait_until("window.myriorama?.statistics.pictures.length", WITHIN).await?;
    let mut stills = Vec::new();
    for turn in TURNS {
        if turn > 0.0 {
            page.turn(turn, 1.0).await?;
        }
        page.browser.run::<Option<()>>(CAPTURE, Vec::new()).await?;
        page.browser.wait_until("window.captured", WITHIN).await?;
        stills.push(page.browser.value("window.captured").await?);
    }
    Ok((stills, processes.device.clone()))
}

/// A model on a device of this process.
struct Reference {
    engine: Arc<GpuEngine>,
    setup: Setup,
}

impl Reference {
    fn new(ground: &Ground, model: PathBuf) -> anyhow::Result<Self> {
        let setup = SceneArgs::new(SceneSpec::File(model)).load()?;
        let engine = GpuEngine::shared(ground.device)?;
        engine.put_scene(setup.offer.hash.as_str(), &setup.scene)?;
        Ok(Self { engine, setup })
    }

    /// The same view, drawn directly.
    fn draw(&self, still: &Captured) -> anyhow::Result<View> {
        let SceneOffer { hash, volume, source_space, .. } = &self.setup.offer;
        let in_world = |point: [f64; 3]| source_space.world_from_source(DVec3::from_array(point));
        let StillCamera { eye, target, fov_y_deg } = still.camera;
        let size_px = UVec2::from_array(still.size_px);
        let fov_y_rad = fov_y_deg.to_radians() as f32;
        let camera = PinholeCamera::looking_at(in_world(eye), in_world(target), Vec3::Y, fov_y_rad, size_px);
        let work = DirectWork {
            scene_hash: hash.to_string(),
            cameras: vec![PinholeCamera { near_m: volume.near_m(), ..camera }],
            lighting: REFERENCE_LIGHTING.to_owned(),
            scene_time_s: 0.0,
            planes: ViewPlanes { antialias: Antialias::MOST, ..ViewPlanes::WITH_DEPTH },
            surfaces_by_rays: None,
        };
        self.engine.draw_direct(&work, Turn::of(WorkClass::Batch))?.pop().context("no view")
    }

    /// The errors of a still over the foreground. Both pictures are files beside the report.
    fn errors(&self, still: &Captured, file: &Path) -> anyhow::Result<PictureErrors> {
        let direct = self.draw(still)?;
        std::fs::create_dir_all(file.parent().context("a folder")?)?;
        std::fs::write(format!("{}-still.png", file.display()), &still.png)?;
        let direct_png = encode_frame(FrameCodec::Png, direct.size_px, &direct.srgb8)?;
        std::fs::write(format!("{}-direct.png", file.display()), direct_png)?;
        let srgb8 = decode_frame(FrameCodec::Png, direct.size_px, &still.png, &DecodeLimits::VIEWS)?;
        let [foreground, _] = PictureErrors::of(&direct, &Rgb8Image::new(direct.size_px.x, direct.size_px.y, &srgb8)?)?;
        Ok(foreground)
    }
}
