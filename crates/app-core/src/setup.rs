//! Arguments that several commands share, and the scene on offer that they make.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::builder::{OsStringValueParser, TypedValueParser as _};
use clap::{Args, Command, FromArgMatches as _};
use cluster::{CommonCell, CommonKind, OfferSettings, PolicyChoice, SamplePlanes, SceneHash, Timeline, Workload};
use coordinator::{OfferedCell, OfferedCube, SceneOffer};
use depth_image::{Aabb, Camera, CubeGrid, PinholeCamera, SampleCamera};
use glam::UVec2;
use gpu::DevicePreference;
use planner::Budget;
use reconstruction::ReconstructionMethod;
use render::Lighting;
use sampling::{Impostors, Rig, SamplingMethod};
use scene::{
    EnvironmentSpec, ImportOptions, LightSpec, Limits, MissingTextures, Scene, SceneSpec, SourceCamera, UpAxis,
};

use crate::camera_file::{self, Placement};
use crate::delivery::default_method;
use crate::exit::BadInput;
use crate::sizes::{BlockGrid, SampleSize};

/// The size of the sample images, as in the paper.
const SAMPLE_SIZE_PX: UVec2 = UVec2::new(400, 300);
/// The height of the paper's sample cameras over the block, in halves of its width.
const TWO_PLANE_HEIGHT: f32 = 3.0;
/// Half the angle between neighbouring cameras in front of a model.
const MODEL_SPREAD_RAD: f32 = 0.12;
/// What the sample cameras of an interior look at is this far away, in diagonals of the scene.
const INTERIOR_SHARE: f32 = 0.3;
/// Walls reach beyond a picture's borders on all sides: samples of an interior are as wide as wide views.
const INTERIOR_ASPECT: UVec2 = UVec2::new(16, 9);

/// The device.
#[derive(Debug, Clone, Copy, Args)]
pub struct DeviceArgs {
    /// any (a GPU if there is one) or software
    #[arg(long, default_value_t, value_name = "NAME", env = "MYRIORAMA_DEVICE")]
    pub device: DevicePreference,
}

/// The scene, its sampling and its lighting.
#[derive(Debug, Clone, Args)]
#[allow(rustdoc::broken_intra_doc_links, reason = "help has optional parts in brackets")]
pub struct SceneArgs {
    /// A scene by name or a file (.gltf, .glb, .obj, .ply). Names: tree-terrain-30k, -125k, -500k, -2m (each also with
    /// -wind), urban, courtyard, gallery, grass, grass:DENSITY, snake (animated), mirror-hall
    #[arg(long, value_name = "SPEC", default_value = "tree-terrain-500k",
        value_parser = OsStringValueParser::new().try_map(SceneSpec::try_from))]
    pub scene: SceneSpec,
    /// What is done about textures that a scene's file names and that are not there: refuse the scene, or show grey
    #[arg(long, default_value_t, value_name = "refuse|grey")]
    pub missing_textures: MissingTextures,
    /// Show a glTF file without an extension that it requires and that is not read; once for each
    #[arg(long = "ignore-required", value_name = "NAME")]
    pub ignore_required: Vec<String>,
    /// The clip of an animated scene that plays, by its name [default: the first]
    #[arg(long, value_name = "NAME")]
    pub clip: Option<String>,
    /// The axis of an .obj or .ply file that points upwards. With another than y, all coordinates are those of the turned
    /// file
    #[arg(long, default_value_t, value_name = "x|y|z")]
    pub up: UpAxis,
    /// How surfaces are lit, as terms with commas between them. Direct light: unlit, phong, shadows, soft N (N rays a light),
    /// or soft NxN (a grid of N by N rays a light, or, with "by maps" or "by samples", shadow maps of rectangle lights, or,
    /// with "by cube", walks through a layered cube).
    /// Light from all around: occlusion N [RADIUSm], or indirect N, with what surfaces send back. Mirrors that show the
    /// scene: reflections N (mirrors that a ray meets, 1 to 8). Glossy surfaces that show it, in views drawn directly, from a
    /// cube or beside a base: glossy N (rays a pixel, 1 to 256)
    #[arg(long, default_value_t, value_name = "TERMS")]
    pub lighting: Lighting,
    /// A lamp in place of the scene's lamps, in the scene file's coordinates; may be repeated. Forms: "sun
    /// towards=X,Y,Z [irradiance=V] [angle=DEG]", "point at=X,Y,Z [intensity=V] [radius=M]", "spot at=X,Y,Z
    /// towards=X,Y,Z [intensity=V] [inner=DEG] [outer=DEG] [radius=M]", "rectangle at=X,Y,Z u=X,Y,Z v=X,Y,Z
    /// [radiance=V]". V is a grey, R,G,B or #rrggbb
    #[arg(long = "light", value_name = "LAMP")]
    pub lights: Vec<LightSpec>,
    /// Light from all directions in place of the scene's: V, or ZENITH/NADIR, or an equirectangular map, FILE.hdr, which is
    /// the background, too. Its bright parts cast shadows with the rays of "soft N" or else of "occlusion N"
    #[arg(long, value_name = "V[/V]|FILE.hdr")]
    pub environment: Option<EnvironmentSpec>,
    /// The reconstruction method; `None` where the user names none
    #[arg(long, visible_alias = "reconstruction", value_name = "NAME",
        help = format!("How views are made. {} [default: shared light where light is traced, direct drawing in plain light; from samples alone, {}, \
            with a cube, a base or a budget, and in experiments]", ReconstructionMethod::help(), ReconstructionMethod::default()))]
    pub method: Option<ReconstructionMethod>,
    /// The sampling method; `None` where the user names none
    #[arg(long, value_name = "NAME",
        help = format!("Which samples are taken. {} [default: {}; {} under indirect light]", SamplingMethod::help(),
            SamplingMethod::default(), SamplingMethod::OF_INDIRECT_LIGHT))]
    pub sampling: Option<SamplingMethod>,
    /// Size of the sample images, or auto: as in --samples, or from a quarter to twice the pixels of 400x300, so that they
    /// are about twice as dense as each session's views
    #[arg(long, default_value_t, value_name = "WxH|auto")]
    pub sample_size: SampleSize,
    /// A layered depth cube of the whole scene, layered_cube:SIDE, beside the sample images: what these leave unknown is found in it
    #[arg(long, value_name = "NAME")]
    pub base: Option<SamplingMethod>,
    /// Blocks of the scene, columns by rows of its ground from 1x1 to 8x8, each with four sample images from above, beside those of
    /// views: for large terrains. Methods that follow rays alone; mirrors show the environment
    #[arg(long, value_name = "CxR", conflicts_with = "base")]
    pub blocks: Option<BlockGrid>,
    /// Images of what each mirror shows, for views from samples in lighting with reflections: pinhole[:N] (1 to 8), or
    /// single_pole[:N], 1 or 2 of the object that the mirror shows largest. Mirrors without images show what --base holds, or
    /// else the environment
    #[arg(long, default_value_t, value_name = "NAME")]
    pub impostors: Impostors,
    /// Sample cameras from a transforms.json, in the scene file's coordinates [default: four, placed from the scene's
    /// bounds]
    #[arg(long, value_name = "FILE")]
    pub samples: Option<PathBuf>,
}

/// A scene with its sample cameras.
#[derive(Clone)]
pub struct Setup {
    /// The scene.
    pub scene: Scene,
    /// The cameras that views stand between.
    pub around: Vec<PinholeCamera>,
    /// The cameras of the samples: the same, unless the sampling method places them elsewhere.
    pub samples: Vec<PinholeCamera>,
    /// The offer for a coordinator.
    pub offer: SceneOffer,
}

impl Setup {
    /// The scene at its start in a light, sampled by these cameras, for work on a device without a cluster.
    #[must_use]
    pub fn workload(&self, sampling: SamplingMethod, lighting: Lighting, cameras: &[PinholeCamera]) -> Workload {
        Workload {
            scene: self.offer.scene(),
            sample_cameras: cameras.iter().copied().map(SampleCamera::from).collect(),
            cell_first_indices: Vec::new(),
            common_cells: Vec::new(),
            sampling: sampling.to_string(),
            lighting: lighting.to_string(),
            planes: SamplePlanes::default(),
            volume: self.offer.volume,
            background: self.offer.background,
            timeline: Timeline::still(0.0),
            illumination: self.offer.illumination.clone(),
            refinement_steps: 1,
            traced_pixel_count: None,
        }
    }

    /// Checks that samples are depth images alone, which not all commands can do without.
    ///
    /// # Errors
    /// They are a cube, or have one or blocks beside them.
    pub fn check_depth_images(&self) -> Result<(), BadInput> {
        if !self.offer.blocks.is_empty() {
            return Err(BadInput("--blocks: this command takes none, up does".to_owned()));
        }
        match (&self.offer.cube, &self.offer.base) {
            (Some(cube), _) => Err(BadInput(format!("--sampling {}: this command needs depth images", cube.sampling))),
            (_, Some((base, _))) => {
                Err(BadInput(format!("--base {}: this command takes none, up does", base.sampling)))
            }
            (None, None) => Ok(()),
        }
    }
}

/// The scene's mirrors, as sessions follow them.
fn mirrors_of(scene: &Scene, impostors: Impostors) -> Vec<OfferedCell> {
    let (mirrors, beyond) = sampling::mirrors(scene, impostors);
    if beyond > 0 {
        tracing::info!(beyond, followed = mirrors.len(), "the smallest mirrors have no images of what they show");
    }
    let sampling = SamplingMethod::default().to_string();
    let offered = mirrors.into_iter().map(|mirror| OfferedCell {
        cell: CommonCell { kind: CommonKind::Mirrors, bounds: mirror.bounds, sampling: sampling.clone() },
        cameras: mirror.cameras,
    });
    offered.collect()
}

impl SceneArgs {
    /// A scene with all other arguments by default.
    #[must_use]
    pub fn new(scene: SceneSpec) -> Self {
        let given = Self::augment_args(Command::new("scene")).try_get_matches_from(["scene"]);
        let defaults = given.and_then(|given| Self::from_arg_matches(&given)).expect("no argument is required");
        Self { scene, ..defaults }
    }

    /// The reconstruction method; without one, the first that the samples suit.
    #[must_use]
    pub fn method(&self) -> ReconstructionMethod {
        let suited = self
            .sampling()
            .layer_selection()
            .and_then(|_| reconstruction::METHODS.into_iter().map(|row| row.method).find(|method| method.walks_cube()));
        self.method.or(suited).unwrap_or_default()
    }

    /// The method that a coordinator offers: a named one, or one that the samples need. Without one it follows from the light of
    /// views.
    pub(crate) fn offered_method(&self) -> Option<ReconstructionMethod> {
        let needs_images = self.base.is_some() || self.blocks.is_some() || !self.sampling().may_hold_light();
        self.method.or_else(|| needs_images.then(|| self.method()))
    }

    /// The method of views from samples in a light, as a client that names none would ask for.
    #[must_use]
    pub fn method_in(&self, lighting: Lighting) -> String {
        match self.offered_method() {
            Some(method) => method.to_string(),
            None => default_method(&lighting.to_string(), &PolicyChoice::Pipeline.into()),
        }
    }

    /// The sampling method; without one, that for the light.
    #[must_use]
    pub fn sampling(&self) -> SamplingMethod {
        self.sampling.unwrap_or_else(|| SamplingMethod::suited_to(self.lighting))
    }

    /// Checks that the arguments leave a budget its choices.
    ///
    /// # Errors
    /// They name what a budget chooses, or samples that it cannot choose.
    pub fn check_for_budget(&self, budget: Budget) -> Result<(), BadInput> {
        let is_cube = self.sampling.is_some_and(|sampling| sampling.layer_selection().is_some());
        let named = [
            (self.method.is_some(), "--method or --quality, which it chooses"),
            (self.sample_size.fixed_px().is_some(), "--sample-size, which it chooses"),
            (is_cube, "a layered cube as --sampling"),
            (self.base.is_some(), "--base"),
            (self.blocks.is_some(), "--blocks"),
        ];
        match named.into_iter().find(|(is_named, _)| *is_named) {
            Some((_, what)) => Err(BadInput(format!("--budget {budget}: none can be kept with {what}"))),
            None => Ok(()),
        }
    }

    /// Loads the scene and places its sample cameras.
    ///
    /// # Errors
    /// A scene or a camera file cannot be used.
    pub fn load(&self) -> anyhow::Result<Setup> {
        let scene = self.load_scene()?;
        let around = self.sample_cameras(&scene)?;
        let samples = self.sampling().cameras(around.clone());
        let cube = self.cube(&scene)?;
        let base = self.base(&scene)?;
        let blocks = self.blocks_of(&scene)?;
        let package = scene::pack(&scene);
        let offer = SceneOffer {
            // A built-in scene's own name, or a file's without folder and ending.
            name: match &self.scene {
                SceneSpec::File(path) => path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
                built_in => built_in.to_string(),
            },
            hash: SceneHash::of(&package),
            package: package.into(),
            mirrors: match cube.is_some() || !blocks.is_empty() {
                true => Vec::new(),
                false => mirrors_of(&scene, self.impostors),
            },
            blocks,
            cube: cube.map(|grid| OfferedCube {
                sampling: self.sampling().to_string(),
                grid,
                light_field: self.sampling().light_field(&scene.bounds()),
                beside: SamplingMethod::default().to_string(),
            }),
            base,
            rig: samples.iter().copied().map(Camera::Pinhole).collect(),
            fits_views: self.sample_size == SampleSize::Auto && self.samples.is_none(),
            volume: scene.bounds(),
            background: scene.background,
            illumination: scene.illumination.clone(),
            source_space: scene.source_space,
            settings: OfferSettings {
                method: Some(self.method().to_string()),
                sampling: self.sampling.map(|sampling| sampling.to_string()),
                lighting: Some(self.lighting.to_string()),
            },
            period_s: scene.period_s().map(f64::from),
        };
        Ok(Setup { scene, around, samples, offer })
    }

    /// The grid of a cube of a still scene; `None` for a method that samples none.
    fn grid(&self, scene: &Scene, option: &str, sampling: SamplingMethod) -> anyhow::Result<Option<CubeGrid>> {
        let cube = sampling.cube(&scene.bounds()).with_context(|| format!("{}: {option} {sampling}", self.scene))?;
        if cube.is_some() && scene.period_s().is_some() {
            return Err(BadInput(format!("{option} {sampling}: {} moves, and a cube holds still", self.scene)).into());
        }
        Ok(cube)
    }

    /// The scene's base, where there is to be one.
    fn base(&self, scene: &Scene) -> anyhow::Result<Option<(CommonCell, CubeGrid)>> {
        let Some(base) = self.base else { return Ok(None) };
        let reason = if self.sampling().layer_selection().is_some() {
            "the samples are a cube already"
        } else if base.light_field(&scene.bounds()).is_some() {
            "a light field shows the mirrors of a cube that is the sampling itself"
        } else if let Some(grid) = self.grid(scene, "--base", base)? {
            let cell = CommonCell { kind: CommonKind::Base, bounds: scene.bounds(), sampling: base.to_string() };
            return Ok(Some((cell, grid)));
        } else {
            "a base is a layered cube: see --sampling"
        };
        Err(BadInput(format!("--base {base}: {reason}")).into())
    }

    /// The scene's blocks with their cameras.
    fn blocks_of(&self, scene: &Scene) -> anyhow::Result<Vec<OfferedCell>> {
        let Some(grid) = self.blocks else { return Ok(Vec::new()) };
        let sampling = self.sampling();
        let method = self.method();
        let reason = if sampling.layer_selection().is_some() {
            format!("{sampling} takes no images of blocks")
        } else if !method.follows_rays() {
            format!("{method} follows no rays from block to block")
        } else {
            let size_px = self.sample_size.fixed_px().unwrap_or(SAMPLE_SIZE_PX);
            let offered = self.block_rigs(scene, grid, size_px)?.into_iter().map(|(bounds, rig)| OfferedCell {
                cell: CommonCell { kind: CommonKind::Block, bounds, sampling: sampling.to_string() },
                cameras: sampling.cameras(rig.samples(size_px)).into_iter().map(Camera::Pinhole).collect(),
            });
            return Ok(offered.collect());
        };
        Err(BadInput(format!("--blocks {grid}: {reason}")).into())
    }

    fn block_rigs(&self, scene: &Scene, grid: BlockGrid, size_px: UVec2) -> anyhow::Result<Vec<(Aabb, Rig)>> {
        // What moves may come to any height.
        let still = scene.animation.is_none().then(|| scene.vertices_in_world());
        let rigs = Rig::of_blocks(&scene.bounds(), grid.0, still.into_iter().flatten(), size_px);
        rigs.with_context(|| format!("{}: --blocks {grid}", self.scene))
    }

    /// The grid of the scene's cube, where that is how it is sampled.
    fn cube(&self, scene: &Scene) -> anyhow::Result<Option<CubeGrid>> {
        let sampling = self.sampling();
        let cube = self.grid(scene, "--sampling", sampling)?;
        if cube.is_some() && self.sample_size.fixed_px().is_some() {
            let reason = "the size of its images follows from SIDE";
            return Err(BadInput(format!("--sample-size: {sampling} has none, {reason}")).into());
        }
        self.check_light_field(scene, sampling)?;
        if let Some(method) = self.method.filter(|method| method.walks_cube() != cube.is_some()) {
            let reason = match cube {
                Some(_) => "makes views of depth images, and not of a cube of layered ones",
                None => "needs a cube of layered images: see --sampling",
            };
            return Err(BadInput(format!("--method {method} {reason}")).into());
        }
        Ok(cube)
    }

    /// Checks that a light field is there for what shows it, and only then.
    fn check_light_field(&self, scene: &Scene, sampling: SamplingMethod) -> Result<(), BadInput> {
        let is_there = sampling.light_field(&scene.bounds()).is_some();
        if is_there && self.lighting.without_reflections().is_none() {
            let reason = "a light field shows mirrors: it needs --lighting with reflections N or glossy N";
            return Err(BadInput(format!("--sampling {sampling}: {reason}")));
        }
        match self.method.filter(|method| method.gathers() && !is_there) {
            Some(method) => Err(BadInput(format!("--method {method} gathers in a light field: see --sampling"))),
            None => Ok(()),
        }
    }

    fn load_scene(&self) -> anyhow::Result<Scene> {
        match &self.scene {
            SceneSpec::File(file) => self.up.check(file),
            built_in => self.up.check(Path::new(&built_in.to_string())),
        }
        .context("--up")?;
        let options =
            ImportOptions { missing_textures: self.missing_textures, ignore_required: self.ignore_required.clone() };
        let mut scene = self.scene.load(&Limits::default(), options).context("the scene cannot be used")?;
        if let Some(name) = &self.clip {
            scene.play(name).with_context(|| format!("{}: --clip", self.scene))?;
        }
        let scene = scene.turned_upright(self.up);
        let lights = (!self.lights.is_empty()).then(|| self.lights.iter().map(|spec| spec.0).collect());
        let lit = match &self.environment {
            None => scene.lit_by(lights, None),
            Some(EnvironmentSpec::Colors(environment)) => scene.lit_by(lights, Some(*environment)),
            Some(EnvironmentSpec::File(path)) => {
                let map = scene::load_environment(path).context("the environment cannot be used")?;
                scene.lit_by(lights, None).surrounded_by(map)
            }
        };
        lit.validate(&Limits::default()).context("the scene cannot be used")?;
        if self.lighting.is_lit() && !lit.has_light() {
            tracing::warn!("nothing lights the scene: all that gives off no light itself will be black");
        }
        Ok(lit)
    }

    fn sample_cameras(&self, scene: &Scene) -> anyhow::Result<Vec<PinholeCamera>> {
        let fixed_px = self.sample_size.fixed_px();
        let size_px = fixed_px.unwrap_or(SAMPLE_SIZE_PX);
        let Some(path) = &self.samples else { return self.rig_cameras(scene, size_px) };
        let near_m = scene.bounds().near_m();
        let cameras = camera_file::read(path, Placement { source_space: scene.source_space, near_m, size_px })?;
        Ok(cameras.into_iter().map(|camera| fixed_px.map_or(camera, |size_px| camera.resized(size_px))).collect())
    }

    fn rig_cameras(&self, scene: &Scene, size_px: UVec2) -> anyhow::Result<Vec<PinholeCamera>> {
        let bounds = scene.bounds();
        if let Some(grid) = self.blocks {
            let blocks = self.block_rigs(scene, grid, size_px)?;
            let over = Rig::over_blocks(&bounds, &blocks);
            return Ok(over.with_context(|| format!("{}: no sample cameras", self.scene))?.samples(size_px));
        }
        let rig = match self.scene {
            // An interior, seen from within.
            SceneSpec::Procedural(_) if !scene.cameras.is_empty() => {
                let SourceCamera { world_from_camera, fov_y_rad, .. } = &scene.cameras[0];
                let distance_m = bounds.size().length() * INTERIOR_SHARE;
                let rig = Rig::around(world_from_camera, *fov_y_rad, distance_m, MODEL_SPREAD_RAD);
                return Ok(rig.samples(UVec2::new(size_px.y * INTERIOR_ASPECT.x / INTERIOR_ASPECT.y, size_px.y)));
            }
            SceneSpec::TreeTerrain { .. } => Rig::two_plane(&bounds, TWO_PLANE_HEIGHT),
            // As it stands first.
            SceneSpec::File(_) if scene.animation.is_some() => {
                Rig::framing(scene.frozen_at(0.0).vertices_in_world(), MODEL_SPREAD_RAD, size_px)
            }
            SceneSpec::File(_) => Rig::framing(scene.vertices_in_world(), MODEL_SPREAD_RAD, size_px),
            _ => Rig::in_front_of(&bounds, MODEL_SPREAD_RAD),
        };
        Ok(rig.with_context(|| format!("{}: no sample cameras", self.scene))?.samples(size_px))
    }
}
