//! Sampling methods: a closed set.
//!
//! Each method is a variant, a row of [`METHODS`], a file pair in this folder, a page in `docs/methods` and a scalar twin. No
//! product code outside this folder names a method.

pub(crate) mod depth_peeling;
pub(crate) mod layered_cube;
pub(crate) mod non_redundant;

use depth_image::{
    Aabb, Antialias, Camera, CameraError, CubeGrid, LightFieldCamera, NamedMethod, PinholeCamera, Setting,
    named_methods,
};
use gpu::{ShaderError, Templates, wgsl_constants, wgsl_files};
use render::{LayerSelection, Lighting, RedundancyTest};

use self::depth_peeling::SAME_LAYER;
use self::non_redundant::{SAME_DEPTH, SAME_FOOTPRINTS};
use crate::error::SamplingError;
pub use layered_cube::{LayeredCube, LightFieldSize};
pub use non_redundant::Redundancy;

/// The choice of samples of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SamplingMethod {
    /// Every visible surface, whether another image holds it too or not (Lages §4.1). The setting is the number of positions
    /// around a texel's centre whose colours count, too.
    Conventional(Antialias),
    /// Only samples that no image before holds (Xie §3).
    NonRedundant(Redundancy),
    /// Layer behind layer from one place: the middle of the sample cameras.
    DepthPeeling {
        /// Images, each of the surfaces behind the one before.
        layers: u32,
    },
    /// All surfaces on the lines of a cube around the scene, for viewers anywhere (Lischinski §3.1).
    LayeredCube(LayeredCube),
}

use SamplingMethod::{Conventional, DepthPeeling, LayeredCube as Cube, NonRedundant};

/// All methods by name; the first is the default.
pub const METHODS: [NamedMethod<SamplingMethod>; 4] = [
    NamedMethod {
        name: "conventional",
        method: SamplingMethod::CONVENTIONAL,
        setting: Some(Setting {
            form: "POSITIONS (2, 4, 8 or 16)",
            parse: |text| text.parse().ok().filter(|&antialias| antialias > Antialias::NONE).map(Conventional),
        }),
        help: "takes every visible surface; a texel's colour can be the mean over as many positions around its centre",
    },
    NamedMethod {
        name: "non_redundant",
        method: NonRedundant(Redundancy::Pixel),
        setting: Some(Setting {
            form: non_redundant::FORM,
            parse: |text| non_redundant::parse(text).map(NonRedundant),
        }),
        help: "takes the samples that no image before holds, by a test; by pixel unless said otherwise",
    },
    NamedMethod {
        name: "depth_peeling",
        method: DepthPeeling { layers: depth_peeling::DEFAULT_LAYERS },
        setting: Some(Setting {
            form: "LAYERS (1 to 16)",
            parse: |text| depth_peeling::parse_layers(text).map(|layers| DepthPeeling { layers }),
        }),
        help: "takes layer behind layer from the middle of the cameras, 4 by default",
    },
    NamedMethod {
        name: "layered_cube",
        method: Cube(LayeredCube::DEFAULT),
        setting: Some(Setting { form: layered_cube::FORM, parse: |text| layered_cube::parse(text).map(Cube) }),
        help: "takes all surfaces on the lines of a cube, for viewers anywhere; 512 lines along its longest side by default; a light \
               field of N directions (66, 258 or 1026), of PX by PX lines each (64 by default), shows glossy surfaces what is around",
    },
];

/// The templates of `render`, with the redundancy tests of all methods.
///
/// # Errors
/// When a text is not a template.
pub fn templates() -> Result<Templates, ShaderError> {
    let own = wgsl_files! {
        "non_redundant/pixel.wgsl", "non_redundant/visibility.wgsl", "depth_peeling.wgsl"
    };
    Ok(render::templates(&own)?.declaring(wgsl_constants! { SAME_DEPTH, SAME_FOOTPRINTS, SAME_LAYER }))
}

named_methods!(SamplingMethod, UnknownSampling, "sampling method");

impl SamplingMethod {
    /// Every visible surface, with the colour of a texel's centre.
    pub const CONVENTIONAL: Self = Conventional(Antialias::NONE);

    /// The method under indirect light where none is named: its samples take longest, and are smoothed, so that pixels which several
    /// images know need to be lit in one of them alone.
    pub const OF_INDIRECT_LIGHT: Self = NonRedundant(Redundancy::Coverage);

    /// The method of images from lamps where none is named: what one lamp's corner hides others show.
    pub const OF_LAMPS: Self = NonRedundant(Redundancy::Pixel);

    /// The method where none is named.
    #[must_use]
    pub fn suited_to(lighting: Lighting) -> Self {
        if lighting.is_indirect() { Self::OF_INDIRECT_LIGHT } else { Self::default() }
    }

    /// All methods, each with all of its redundancy tests.
    pub fn all() -> impl Iterator<Item = Self> {
        METHODS.into_iter().flat_map(|row| match row.method {
            NonRedundant(_) => Redundancy::ALL.map(NonRedundant).to_vec(),
            method @ (Conventional(_) | DepthPeeling { .. } | Cube(_)) => vec![method],
        })
    }

    /// The number of images of a set, where it is part of the method.
    #[must_use]
    pub fn own_image_count(self) -> Option<u32> {
        if let DepthPeeling { layers } = self { Some(layers) } else { None }
    }

    /// The method for sets of `count` images.
    #[must_use]
    pub fn with_images(self, count: u32) -> Self {
        if let DepthPeeling { .. } = self { DepthPeeling { layers: count } } else { self }
    }

    /// The cube of a scene within these bounds; `None` where images are those of cameras.
    ///
    /// # Errors
    /// Bounds that are empty or not finite.
    pub fn cube(self, bounds: &Aabb) -> Result<Option<CubeGrid>, CameraError> {
        if let Cube(cube) = self { CubeGrid::around(bounds, cube.side).map(Some) } else { Ok(None) }
    }

    /// The lines of a light field of a scene within these bounds; `None` without one.
    #[must_use]
    pub fn light_field(self, bounds: &Aabb) -> Option<LightFieldCamera> {
        let Cube(cube) = self else { return None };
        cube.light_field.map(|field| LightFieldCamera::around(*bounds, field.directions, field.side_px))
    }

    /// The surfaces that images of all surfaces keep; `None` where images have the first ones alone.
    #[must_use]
    pub fn layer_selection(self) -> Option<LayerSelection> {
        if let Cube(cube) = self { Some(cube.kept) } else { None }
    }

    /// The cameras that images are taken with, for a rig of these cameras. Those of a cube follow from the scene.
    #[must_use]
    pub fn cameras(self, rig: Vec<PinholeCamera>) -> Vec<PinholeCamera> {
        if let DepthPeeling { layers } = self { depth_peeling::cameras(&rig, layers as usize) } else { rig }
    }

    /// Checks that the method can take images with these cameras.
    ///
    /// # Errors
    /// Names the first camera that it cannot take one with.
    pub fn check(self, cameras: &[Camera]) -> Result<(), SamplingError> {
        match self {
            DepthPeeling { .. } => depth_peeling::check(cameras),
            Cube(_) => Err(SamplingError::Lines { method: self.to_string() }),
            Conventional(_) | NonRedundant(_) => Ok(()),
        }
    }

    /// The positions around a texel's centre whose colours count.
    #[must_use]
    pub fn antialias(self) -> Antialias {
        if let Conventional(antialias) = self { antialias } else { Antialias::NONE }
    }

    /// Whether samples may hold light in place of colour: those of one position a texel, in depth images of several places.
    #[must_use]
    pub fn may_hold_light(self) -> bool {
        match self {
            Conventional(antialias) => antialias == Antialias::NONE,
            NonRedundant(_) => true,
            DepthPeeling { .. } | Cube(_) => false,
        }
    }

    /// The test by which an image omits samples that others hold, and shows what lies behind.
    #[must_use]
    pub fn redundancy_test(self) -> Option<RedundancyTest> {
        match self {
            Conventional(_) | Cube(_) => None,
            NonRedundant(redundancy) => redundancy.test(),
            DepthPeeling { .. } => Some(depth_peeling::TEST),
        }
    }

    /// Whether an image omits pixels that the surfaces of images before cover.
    #[must_use]
    pub fn omits_covered_pixels(self) -> bool {
        self == NonRedundant(Redundancy::Coverage)
    }

    /// Whether each image, and each tile of one, can be taken without the others.
    #[must_use]
    pub fn images_are_independent(self) -> bool {
        self.redundancy_test().is_none()
    }

    /// Whether an image can only be taken after those before it: then a set's images are taken on one node.
    #[must_use]
    pub fn images_are_sequential(self) -> bool {
        self.redundancy_test().is_some_and(|test| !test.traces_rays())
    }

    /// The setting as users spell it.
    fn setting(self) -> Option<String> {
        match self {
            Conventional(antialias) => (antialias > Antialias::NONE).then(|| antialias.to_string()),
            NonRedundant(redundancy) => Some(redundancy.to_string()),
            DepthPeeling { layers } => Some(layers.to_string()),
            Cube(cube) => Some(cube.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_parsed_and_printed_alike_and_other_texts_are_refused() {
        for method in SamplingMethod::all() {
            assert_eq!(method.to_string().parse(), Ok(method));
        }
        assert_eq!(SamplingMethod::all().count(), 6);
        assert_eq!("non-redundant".parse(), Ok(NonRedundant(Redundancy::Pixel)));
        let filtered = Conventional(Antialias::of(4).expect("offered"));
        assert_eq!(("conventional:4".parse(), filtered.to_string().as_str()), (Ok(filtered), "conventional:4"));
        for name in [
            "",
            "conventional:1",
            "conventional:3",
            "non_redundant:",
            "non_redundant:id",
            "depth_peeling:0",
            "depth_peeling:17",
            "depth_peeling:-1",
            "layered_cube:15",
            "layered_cube:4097",
            "layered_cube:512:none",
            "layered_cube:512:all:all",
        ] {
            assert!(name.parse::<SamplingMethod>().is_err(), "{name}");
        }
    }

    #[test]
    fn indirect_light_is_sampled_by_coverage_and_other_light_by_the_first_method() {
        for (lighting, method) in [
            ("soft 16, indirect 64", "non_redundant:coverage"),
            ("soft 16, occlusion 16", "conventional"),
            ("phong", "conventional"),
        ] {
            let lighting = lighting.parse().expect("a lighting");
            assert_eq!(SamplingMethod::suited_to(lighting).to_string(), method);
        }
    }

    #[test]
    fn the_table_lists_every_method_by_its_own_name() {
        for row in &METHODS {
            assert_eq!(row.name.parse(), Ok(row.method), "{}", row.name);
            assert_eq!(row.method.to_string().split(':').next(), Some(row.name));
        }
    }

    #[test]
    fn the_error_names_every_method_and_test() {
        let error = "peeling".parse::<SamplingMethod>().expect_err("no method").to_string();
        for name in ["conventional", "non_redundant:TEST", "visibility", "coverage", "depth_peeling:LAYERS"] {
            assert!(error.contains(name), "{name} is not in {error}");
        }
    }
}
