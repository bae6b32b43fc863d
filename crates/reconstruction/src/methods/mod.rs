//! Reconstruction methods: a closed set.
//!
//! Each method is a variant, a row of [`METHODS`], a file pair in this folder, a page in `docs/methods` and a scalar
//! twin. No product code outside this folder names a method.

pub(crate) mod hybrid_mesh;
pub(crate) mod joint_carve;
pub(crate) mod layered;
pub(crate) mod light_field_search;
pub(crate) mod mesh;

use std::ops::RangeInclusive;
use std::sync::Arc;

use depth_image::{LightCacheQuality, MAX_REFLECTIONS, NamedMethod, Setting, named_methods};
use gpu::{Turn, wgsl_files};

use self::joint_carve::MAX_STOP_LEVEL;
use self::light_field_search::{DEFAULT_STEPS, MAX_STEPS};
use crate::bounce::Bounces;
use crate::quads::{self, Cut, ErrorBound, Mesh as QuadMesh, QuadDrawing, QuadVertices};
use crate::{device::Device, error::ReconstructionError, pixel_list::PixelList};
use crate::{recording::Recording, sample_set::SampleSet};

/// How views are found in depth images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ReconstructionMethod {
    /// Lages §4.2: a linear search, refined by bisection.
    LightFieldSearch {
        /// From where a ray enters the volume to where it leaves it.
        steps: u32,
    },
    /// Min-max pyramids of all cameras traversed together; weighted blending.
    JointCarve {
        /// The pyramid level at which the search ends; 0 is exact.
        stop_level: u32,
    },
    /// Two triangles between each four neighbouring samples of one surface.
    Mesh,
    /// Xie's Algorithm 4: each sample a quad of its texel, its corners shared with its neighbours.
    HybridMesh {
        /// Blocks of quads that are flat within this bound are merged; `None` merges none.
        merged: Option<ErrorBound>,
    },
    /// Rays walk through a layered depth cube and meet the planes of its samples.
    Layered {
        /// Mirrors on a ray's way that are followed; what the next one shows is gathered in a light field. All, where none is given.
        followed: Option<u32>,
    },
    /// Surfaces come from the scene, their light from the samples. `render` makes such views, not this crate.
    LightCache {
        /// The certainty that light of samples must have.
        quality: LightCacheQuality,
    },
}

use ReconstructionMethod::{HybridMesh, JointCarve, Layered, LightCache, LightFieldSearch, Mesh};

/// All methods by name; the first is the default.
pub const METHODS: [NamedMethod<ReconstructionMethod>; 6] = [
    NamedMethod {
        name: "joint_carve",
        method: JointCarve { stop_level: 0 },
        setting: Some(Setting {
            form: "LEVEL (0 to 8)",
            parse: |text| number(text, 0..=MAX_STOP_LEVEL).map(|stop_level| JointCarve { stop_level }),
        }),
        help: "traverses the depth pyramids of all cameras together, down to a level; 0 is exact",
    },
    NamedMethod {
        name: "light_field_search",
        method: LightFieldSearch { steps: DEFAULT_STEPS },
        setting: Some(Setting {
            form: "STEPS (1 to 1024)",
            parse: |text| number(text, 1..=MAX_STEPS).map(|steps| LightFieldSearch { steps }),
        }),
        help: "searches along each ray in equal steps, 100 by default",
    },
    NamedMethod { name: "mesh", method: Mesh, setting: None, help: "draws a quad between each four samples" },
    NamedMethod {
        name: "hybrid_mesh",
        method: HybridMesh { merged: None },
        setting: Some(Setting {
            form: "PX (0.01 to 100)",
            parse: |text| ErrorBound::from_px(text.parse().ok()?).map(|bound| HybridMesh { merged: Some(bound) }),
        }),
        help: "draws a quad for each sample, and merges quads where nothing moves by more than PX pixels",
    },
    NamedMethod {
        name: "layered",
        method: ReconstructionMethod::LAYERED,
        setting: Some(Setting {
            form: "MIRRORS (0 to 8)",
            parse: |text| number(text, 0..=MAX_REFLECTIONS).map(|mirrors| Layered { followed: Some(mirrors) }),
        }),
        help: "walks through a layered cube, and meets the planes of its samples; with MIRRORS, rays are followed off at most that \
               many mirrors, and what the next one shows is gathered in a light field",
    },
    NamedMethod {
        name: "light_cache",
        method: LightCache { quality: LightCacheQuality::Balanced },
        setting: Some(Setting {
            form: "QUALITY (draft, fast, balanced, fine or exact)",
            parse: |text| LightCacheQuality::named(text).map(|quality| LightCache { quality }),
        }),
        help: "takes surfaces from the scene and light from the samples; lights points that no sample knows in the view, balanced by default",
    },
];

/// A whole number within bounds.
fn number(text: &str, bounds: RangeInclusive<u32>) -> Option<u32> {
    text.parse().ok().filter(|number| bounds.contains(number))
}

/// The steps of the search, and the bound of merged quads in pixels, among which budgets choose.
const LADDER_STEPS: u32 = 64;
const LADDER_BOUND_PX: f64 = 0.5;

/// The templates of all methods.
pub(crate) const SHADERS: [(&str, &str); 8] = wgsl_files! {
    "joint_carve.wgsl", "joint_carve/march.wgsl", "joint_carve/march_image.wgsl", "joint_carve/smooth.wgsl", "light_field_search.wgsl", "mesh.wgsl", "hybrid_mesh.wgsl", "layered.wgsl"
};

named_methods!(ReconstructionMethod, UnknownMethod, "reconstruction method");

impl From<LightCacheQuality> for ReconstructionMethod {
    fn from(quality: LightCacheQuality) -> Self {
        LightCache { quality }
    }
}

impl ReconstructionMethod {
    /// Walks through a layered cube, and follows all mirrors.
    pub const LAYERED: Self = Layered { followed: None };

    /// Draws the shadow maps of lamps where none is named.
    #[must_use]
    pub fn lamp_default() -> Self {
        HybridMesh { merged: ErrorBound::from_px(LADDER_BOUND_PX) }
    }

    /// Whether views are drawn as quads of the samples.
    #[must_use]
    pub fn draws_quads(self) -> bool {
        matches!(self, Mesh | HybridMesh { .. })
    }

    /// Sample images need normals and the inverse depths at corners of texels, beside colour and depth.
    #[must_use]
    pub fn needs_corners(self) -> bool {
        matches!(self, HybridMesh { .. })
    }

    /// The methods for views from images alone among which budgets choose: the one that is best in most scenes, and one that draws.
    #[must_use]
    pub fn planned_from_images() -> [Self; 2] {
        [JointCarve { stop_level: 0 }, HybridMesh { merged: None }]
    }

    /// The methods for views from images alone, some with several settings.
    pub fn from_images() -> impl Iterator<Item = Self> {
        [
            JointCarve { stop_level: 1 },
            JointCarve { stop_level: 0 },
            LightFieldSearch { steps: LADDER_STEPS },
            Mesh,
            HybridMesh { merged: ErrorBound::from_px(LADDER_BOUND_PX) },
            HybridMesh { merged: None },
        ]
        .into_iter()
    }

    /// The same method with less to do for coarser views; `None` where it has no coarser setting.
    #[must_use]
    pub fn coarser(self) -> Option<Self> {
        match self {
            LightFieldSearch { steps } => (steps > 1).then_some(LightFieldSearch { steps: steps / 2 }),
            JointCarve { stop_level } if stop_level < MAX_STOP_LEVEL => Some(JointCarve { stop_level: stop_level + 1 }),
            LightCache { quality } => quality.lower().map(|quality| LightCache { quality }),
            JointCarve { .. } | Mesh | HybridMesh { .. } | Layered { .. } => None,
        }
    }

    /// The quality of views whose surfaces come from the scene; their samples have light in place of colour. `None` for methods
    /// that find surfaces in samples.
    #[must_use]
    pub fn light_cache_quality(self) -> Option<LightCacheQuality> {
        if let LightCache { quality } = self { Some(quality) } else { None }
    }

    /// Views come from a layered cube; those of other methods from depth images.
    #[must_use]
    pub fn walks_cube(self) -> bool {
        matches!(self, Layered { .. })
    }

    /// What mirrors show is gathered in a light field, which the set must have.
    #[must_use]
    pub fn gathers(self) -> bool {
        matches!(self, Layered { followed: Some(_) })
    }

    /// Rays are followed from where their tiles start; other methods draw, or walk through a cube.
    #[must_use]
    pub fn follows_rays(self) -> bool {
        matches!(self, LightFieldSearch { .. } | JointCarve { .. })
    }

    /// Records the method's passes, for listed pixels or for all; gives the pixels that stay unknown. Lists are for methods that
    /// follow rays. Methods that walk through a cube add highlights and what mirrors show, by `bounces`.
    pub(crate) fn record(
        self,
        drawing: &QuadDrawing,
        mesh: Option<&QuadMesh>,
        recording: &mut Recording<'_>,
        listed: Option<&PixelList>,
        bounces: Option<&Bounces<'_>>,
    ) -> Result<PixelList, ReconstructionError> {
        match self {
            LightFieldSearch { steps } => light_field_search::record(recording, steps, listed),
            JointCarve { stop_level } => joint_carve::record(recording, stop_level, listed),
            Mesh | HybridMesh { .. } => quads::record(drawing, recording, mesh),
            Layered { followed } => layered::record(recording, bounces, followed),
            LightCache { .. } => Err(ReconstructionError::NoScene { method: self.to_string() }),
        }
    }

    /// Begins the sums over positions from the first one, and gives the pixels that further positions are to find; `None`
    /// for methods that find all pixels at each position.
    pub(crate) fn share_positions(
        self,
        recording: &mut Recording<'_>,
    ) -> Result<Option<PixelList>, ReconstructionError> {
        if let JointCarve { .. } = self { joint_carve::smooth::record(recording).map(Some) } else { Ok(None) }
    }

    /// The set's quads, cut when they are first asked for; `None` for methods that draw none.
    pub(crate) fn mesh(
        self,
        device: &Device,
        set: &SampleSet,
        turn: Turn,
    ) -> Result<Option<Arc<QuadMesh>>, ReconstructionError> {
        let cut = match self {
            LightFieldSearch { .. } | JointCarve { .. } | Layered { .. } | LightCache { .. } => return Ok(None),
            Mesh => Cut { vertices: QuadVertices::AtSamples, merged: None },
            HybridMesh { merged } => Cut { vertices: QuadVertices::AtTexelCorners, merged },
        };
        quads::mesh(device, set, cut, turn).map(Some)
    }

    /// The setting as users spell it; `None` where the name alone says it.
    fn setting(self) -> Option<String> {
        match self {
            LightFieldSearch { steps } => Some(steps.to_string()),
            JointCarve { stop_level } => (stop_level > 0).then(|| stop_level.to_string()),
            Mesh => None,
            Layered { followed } => followed.map(|mirrors| mirrors.to_string()),
            HybridMesh { merged } => merged.map(|bound| bound.to_string()),
            LightCache { quality } => (quality != LightCacheQuality::default()).then(|| quality.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_parsed_and_printed_alike_and_other_texts_are_refused() {
        let meshes = ["mesh", "hybrid_mesh", "hybrid_mesh:0.01", "hybrid_mesh:0.5", "hybrid_mesh:2", "hybrid_mesh:100"];
        for name in ["joint_carve", "joint_carve:3", "light_field_search:8"].into_iter().chain(meshes) {
            assert_eq!(name.parse::<ReconstructionMethod>().expect(name).to_string(), name);
            assert_eq!(name.replace('_', "-").parse::<ReconstructionMethod>().expect(name).to_string(), name);
        }
        for name in ["light_cache", "light_cache:draft", "light_cache:fast", "light_cache:fine", "light_cache:exact"] {
            assert_eq!(name.parse::<ReconstructionMethod>().expect(name).to_string(), name);
        }
        assert_eq!("light_cache:balanced".parse(), "light_cache".parse::<ReconstructionMethod>());
        for name in [
            "",
            "light_cache:",
            "light_cache:best",
            "light_cache:Fine",
            "carve",
            "joint_carve:9",
            "light_field_search:0",
            "light_field_search:-1",
            "light_field_search:1025",
            "light_field_search:99999999999",
            "mesh:1",
            "hybrid_mesh:",
            "hybrid_mesh:0",
            "hybrid_mesh:0.001",
            "hybrid_mesh:0.123",
            "hybrid_mesh:-1",
            "hybrid_mesh:101",
            "hybrid_mesh:NaN",
            "hybrid_mesh:inf",
        ] {
            assert!(name.parse::<ReconstructionMethod>().is_err(), "{name}");
        }
    }

    #[test]
    fn the_table_lists_every_method_by_its_own_name() {
        for row in &METHODS {
            assert_eq!(row.name.parse(), Ok(row.method), "{}", row.name);
            assert_eq!(row.method.to_string().split(':').next(), Some(row.name));
        }
        assert_eq!("light_field_search".parse(), Ok(LightFieldSearch { steps: 100 }));
    }

    #[test]
    fn settings_have_the_bounds_that_their_form_says() {
        let mut checked = 0;
        let numbered = METHODS.iter().filter(|row| row.method.light_cache_quality().is_none());
        for (row, setting) in numbered.filter_map(|row| Some((row, row.setting?))) {
            let range = setting.form.split(['(', ')']).nth(1).expect("a range");
            let (least, greatest) = range.split_once(" to ").expect("two bounds");
            for text in [least, greatest] {
                let name = format!("{}:{text}", row.name);
                assert!(name.parse::<ReconstructionMethod>().is_ok(), "{name}");
            }
            let beyond = greatest.parse::<u32>().expect("a whole number") + 1;
            assert_eq!((setting.parse)(&beyond.to_string()), None, "{}:{beyond}", row.name);
            checked += 1;
        }
        assert_eq!(checked, 4);
    }

    #[test]
    fn coarser_settings_end() {
        let settings = |name: &str| {
            let next = |method: &ReconstructionMethod| method.coarser();
            std::iter::successors(Some(name.parse::<ReconstructionMethod>().expect(name)), next).count()
        };
        assert_eq!((settings("light_field_search:100"), settings("joint_carve"), settings("mesh")), (7, 9, 1));
        assert_eq!(settings("light_cache:exact"), 5);
    }

    #[test]
    fn the_error_names_every_method() {
        let error = "carve".parse::<ReconstructionMethod>().expect_err("no method").to_string();
        for name in [
            "joint_carve:LEVEL",
            "light_field_search:STEPS",
            " mesh,",
            "hybrid_mesh:PX",
            " layered",
            "light_cache:QUALITY",
        ] {
            assert!(error.contains(name), "{name} is not in {error}");
        }
    }
}
