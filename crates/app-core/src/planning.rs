//! The representations among which a budget chooses for a scene, and the terms of a plan on one device.

use anyhow::Context as _;
use cluster::SceneHash;
use codec::FrameCodec;
use coordinator::fitting_size_px;
use coordinator::schedule::EqualNodes;
use depth_image::{Camera, ViewCell, ViewPlanes};
use glam::{UVec2, Vec2};
use planner::{Budget, KeptKey, Ladder, PlanRequest, most_certified};
use probe::{DirectCosts, Representation, Subject, Viewpoints};
use render::Lighting;
use sampling::SamplingMethod;

use crate::exit::BadInput;
use crate::setup::{SceneArgs, Setup};

/// The views to plan for.
#[derive(Debug, Clone, Copy)]
pub struct PlannedViews {
    /// Columns and rows.
    pub size_px: UVec2,
    /// How a view's colour is sampled.
    pub planes: ViewPlanes,
    /// How views are delivered.
    pub codec: FrameCodec,
    /// The moment.
    pub scene_time_s: f32,
    /// The seed of views that are drawn at random.
    pub seed: u64,
}

/// A scene, its ladder, and the views to plan for.
#[derive(Debug, Clone)]
pub struct Planning {
    /// The rows.
    pub ladder: Ladder,
    /// The representation of each row, in order.
    pub representations: Vec<Representation>,
    /// What is measured.
    pub subject: Subject,
    /// From where views are seen.
    pub viewpoints: Viewpoints,
    /// How views are delivered.
    pub codec: FrameCodec,
}

impl Planning {
    /// The ladder of a scene. What the user names (methods, size of sample images, sample cameras) is the same in all rows.
    ///
    /// # Errors
    /// The scene has no sample cameras, or the user's choices leave no row.
    pub fn new(setup: &Setup, args: &SceneArgs, views: &PlannedViews) -> anyhow::Result<Self> {
        if args.lighting.without_reflections().is_some() {
            let reason = "no budget can be kept for mirrors that show the scene";
            return Err(BadInput(format!("--lighting {}: {reason}", args.lighting)).into());
        }
        setup.check_depth_images()?;
        let cell = ViewCell::between(&setup.around).context("no sample cameras")?;
        let view = cell.camera_at(Vec2::ZERO, views.size_px);
        let rig: Vec<Camera> = setup.around.iter().copied().map(Camera::Pinhole).collect();
        let fixed_px = args.sample_size.fixed_px();
        let whole_px = fixed_px.or_else(|| fitting_size_px(&rig, &view)).context("the views have no size")?;
        let rows = args.rows(setup.around.len() as u32);
        let mut representations = Vec::with_capacity(rows.len());
        for row in &rows {
            let sampling = row.sampling.parse::<SamplingMethod>()?.with_images(row.camera_count);
            let cameras = match args.samples {
                Some(_) => {
                    let size_px = row.size_px(whole_px);
                    sampling.cameras(setup.around.iter().map(|camera| camera.resized(size_px)).collect())
                }
                None => row.cameras(&cell, whole_px),
            };
            let sample_cameras = cameras.into_iter().map(Camera::Pinhole).collect();
            let sampling = sampling.to_string();
            representations.push(Representation { sampling, method: row.method.clone(), sample_cameras });
        }
        let subject = setup.subject(args.lighting, views.planes, views.scene_time_s);
        let viewpoints = Viewpoints { cell, view_px: views.size_px, seed: views.seed };
        Ok(Self { ladder: Ladder::new(rows)?, representations, subject, viewpoints, codec: views.codec })
    }

    /// The name of the measurements that this plan may use.
    #[must_use]
    pub fn key(&self) -> KeptKey {
        let Subject { scene_hash, lighting, planes, scene_time_s, .. } = &self.subject;
        let Viewpoints { cell, view_px, .. } = &self.viewpoints;
        let light = format!("{lighting}; screened in {}; at {scene_time_s} s", self.subject.screening_lighting);
        // The sizes and places of sample cameras are the user's at times, and are no part of a row.
        let rows = format!("{:?} {:?}", self.ladder.rows(), self.representations);
        KeptKey {
            scene: scene_hash.clone(),
            cell: hash(&format!("{cell:?}")),
            lighting: hash(&light),
            view_size: format!("{}x{}, {} samples a pixel", view_px.x, view_px.y, planes.antialias.samples()),
            ladder_version: hash(&rows),
        }
    }

    /// The request of a plan for sets of `views_a_set` views, on a device that may measure for `allowance_s` seconds.
    #[must_use]
    pub fn request(&self, budget: Budget, device: String, views_a_set: usize, allowance_s: f64) -> PlanRequest {
        let is_traced = self.subject.lighting != self.subject.screening_lighting;
        PlanRequest {
            plan: 1,
            budget,
            key: self.key(),
            device,
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
            pricing: format!("one node, {views_a_set} views a set"),
            allowance_s,
            most_certified: most_certified(is_traced),
            seed: self.viewpoints.seed,
        }
    }
}

/// The light in which rows are compared where rays are traced in the light of a session; `None` elsewhere, and for a light
/// that is not known here.
#[must_use]
pub fn screening_light(lighting: &str) -> Option<String> {
    let lighting: Lighting = lighting.parse().ok()?;
    lighting.is_traced().then(|| Lighting::default().to_string())
}

fn hash(text: &str) -> String {
    SceneHash::of(text.as_bytes()).to_string()
}

impl Setup {
    /// The scene as it is measured in a light.
    #[must_use]
    pub fn subject(&self, lighting: Lighting, planes: ViewPlanes, scene_time_s: f32) -> Subject {
        let lighting = lighting.to_string();
        Subject {
            scene_hash: self.offer.hash.to_string(),
            volume: self.offer.volume,
            background: self.offer.background,
            illumination: self.offer.illumination.clone(),
            screening_lighting: screening_light(&lighting).unwrap_or_else(|| lighting.clone()),
            lighting,
            scene_time_s,
            planes,
        }
    }
}

/// Prices on a cluster of one node, for sets of `views_a_set` views.
#[must_use]
pub fn one_node(views_a_set: usize, direct: DirectCosts) -> EqualNodes {
    let DirectCosts { direct_view_s, encode_view_s } = direct;
    EqualNodes { nodes: 1, cells: 1, views_a_set, direct_view_s: Some(direct_view_s), encode_view_s }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use codec::FrameCodec;
    use planner::{MAX_ROWS, Row};

    use reconstruction::ReconstructionMethod;

    use super::*;
    use crate::ladder::CAMERA_COUNTS;
    use crate::sizes::SampleSize;

    /// The arguments of a scene, as from a command line.
    fn args(more: &[&str]) -> SceneArgs {
        use clap::{Args as _, FromArgMatches as _};
        let command = SceneArgs::augment_args(clap::Command::new("test"));
        let matches = command.get_matches_from(["test", "--scene", "courtyard"].iter().chain(more));
        SceneArgs::from_arg_matches(&matches).unwrap()
    }

    fn planning(more: &[&str]) -> Planning {
        let args = args(more);
        let size_px = UVec2::new(200, 150);
        let planes = ViewPlanes::COLOR;
        let codec = FrameCodec::default();
        let views = PlannedViews { size_px, planes, codec, scene_time_s: 0.0, seed: 0 };
        Planning::new(&args.load().unwrap(), &args, &views).unwrap()
    }

    fn distinct<T: Ord>(planning: &Planning, of: impl Fn(&Row) -> T) -> BTreeSet<T> {
        planning.ladder.rows().iter().map(of).collect()
    }

    #[test]
    fn the_ladder_has_every_method_and_the_default_representation() {
        let planning = planning(&[]);
        let rows = planning.ladder.rows();
        assert!(rows.len() == 180 && rows.len() <= MAX_ROWS);
        let samplings: BTreeSet<String> = SamplingMethod::ladder().map(|(name, _)| name.to_owned()).collect();
        assert_eq!(distinct(&planning, |row| row.sampling.clone()), samplings);
        let methods: BTreeSet<String> = ReconstructionMethod::ladder().map(|method| method.to_string()).collect();
        assert_eq!(distinct(&planning, |row| row.method.clone()), methods);
        assert!(methods.len() <= 6);
        let default = (SamplingMethod::default().to_string(), ReconstructionMethod::default().to_string());
        let is_default = |row: &&Row| {
            (row.sampling.clone(), row.method.clone()) == default && row.camera_count == 4 && row.side_ratio == 1.0
        };
        assert_eq!(rows.iter().filter(is_default).count(), 1);
    }

    #[test]
    fn effort_rises_by_rank_within_a_method() {
        let planning = planning(&[]);
        let kinds = distinct(&planning, |row| row.kind.clone());
        for kind in kinds {
            let ranks: BTreeSet<(String, u32)> = planning
                .ladder
                .rows()
                .iter()
                .filter(|row| row.kind == kind)
                .map(|row| (row.method.clone(), row.rank))
                .collect();
            let numbers: BTreeSet<u32> = ranks.iter().map(|(_, rank)| *rank).collect();
            assert_eq!(numbers, (0..ranks.len() as u32).collect(), "{kind}: {ranks:?}");
        }
    }

    #[test]
    fn representations_have_the_cameras_and_sizes_of_their_rows() {
        let planning = planning(&[]);
        for (row, representation) in planning.ladder.rows().iter().zip(&planning.representations) {
            assert_eq!(representation.sample_cameras.len(), row.camera_count as usize, "{row}");
            let camera = representation.sample_cameras[0].reference();
            assert_eq!(camera.size_px.x, (400.0 * row.side_ratio).round() as u32, "{row}");
            let sampling: SamplingMethod = representation.sampling.parse().unwrap();
            sampling.check(&representation.sample_cameras).unwrap();
        }
        let of = |count: u32| {
            let place = planning.ladder.rows().iter().position(|row| row.camera_count == count).unwrap();
            planning.representations[place].sample_cameras.clone()
        };
        assert!(of(8).starts_with(&of(4)) && of(4).starts_with(&of(2)), "sets share their images");
        assert_eq!(of(1)[0], of(8)[4], "one camera stands in the middle");
    }

    #[test]
    fn what_the_user_names_is_the_same_in_all_rows() {
        let default = ReconstructionMethod::default().to_string();
        let one = planning(&["--method", &default]);
        assert_eq!(distinct(&one, |row| row.method.clone()), BTreeSet::from([default]));
        let sized = planning(&["--sample-size", "320x240"]);
        let camera = sized.representations[0].sample_cameras[0].reference();
        assert_eq!((camera.size_px, sized.ladder.rows().len()), (UVec2::new(320, 240), 60));
        assert_eq!(args(&["--sample-size", "320x240"]).sample_size, SampleSize::Fixed(UVec2::new(320, 240)));
        for sampling in SamplingMethod::all().filter(|sampling| sampling.layer_selection().is_none()) {
            let fixed = planning(&["--sampling", &sampling.to_string()]);
            let counts = distinct(&fixed, |row| row.camera_count);
            let expected =
                sampling.own_image_count().map_or(BTreeSet::from(CAMERA_COUNTS), |own| BTreeSet::from([own]));
            assert_eq!(counts, expected, "{sampling}");
            assert!(fixed.representations.iter().all(|of| of.sampling == sampling.to_string()));
        }
    }

    #[test]
    fn measurements_of_another_light_ladder_or_cell_have_another_name() {
        let key = planning(&[]).key();
        assert_eq!(key, planning(&[]).key());
        let differing: [&[&str]; 3] =
            [&["--lighting", "unlit"], &["--sample-size", "320x240"], &["--lighting", "soft 4"]];
        assert!(differing.iter().all(|more| planning(more).key() != key));
        let sized = |size: &str| planning(&["--sample-size", size]).key();
        assert_ne!(sized("320x240"), sized("640x480"), "equal rows of other images");
    }
}
