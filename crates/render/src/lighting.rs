//! How surfaces are lit: the quality of a finished picture, the same for samples and for direct rendering.

use std::{fmt, num::NonZeroU32, str::FromStr};

use depth_image::{Highlight, LightCacheQuality, MAX_REFLECTIONS};

/// Most rays a light, or of occlusion, a pixel.
pub const MAX_RAYS: u32 = 4096;

/// Rays a pixel of points that no sample knows, where the lighting has as many: in pictures that people look at for long, and in
/// those that pass.
const LEAST_RAYS_HERE: NonZeroU32 = NonZeroU32::new(16).unwrap();
const LEAST_RAYS_IN_MOTION: NonZeroU32 = NonZeroU32::new(4).unwrap();

/// Most points of a grid on a lamp, along a side.
pub const MAX_GRID_SIDE: u32 = 32;

/// Most rays of a lobe, a pixel.
pub const MAX_GLOSSY_RAYS: u32 = 256;

/// A lighting, written as terms with commas between them: `soft 16, occlusion 16`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Lighting {
    /// Light of lamps.
    pub direct: Direct,
    /// Light from all around by rays; without them all of the environment's light arrives.
    pub ambient: Option<Ambient>,
    /// The mirrors that a ray meets, one after the other; without any, mirrors show lamps and the environment.
    pub reflections: Option<NonZeroU32>,
    /// Rays a pixel into the lobe of what it shows, as far as `reflections` does not follow its mirrored ray; without them rough
    /// reflectors mirror the environment alone, but where a light field is gathered.
    pub glossy: Option<NonZeroU32>,
}

/// Light of lamps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Direct {
    /// Colours as they are: no light at all.
    Unlit,
    /// From the middle of every lamp whatever is in between, with Blinn-Phong highlights.
    #[default]
    Phong,
    /// One ray to the middle of every lamp; highlights by GGX, as for all that follow.
    Shadows,
    /// This many rays to places spread over every lamp.
    Soft(NonZeroU32),
    /// A regular grid of places on every lamp, with this many along a side (Xie et al., Algorithm 5).
    Grid(NonZeroU32, GridVisibility),
}

/// How the places of a grid that a point sees are found. Maps are of rectangles: the places of other lamps are found by rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum GridVisibility {
    /// One ray to each place.
    #[default]
    Rays,
    /// A shadow map of the scene from each place.
    Maps,
    /// A shadow map from each place, of what sample images from the lamp hold.
    Samples,
    /// A walk to each place, and to those of lamps of all kinds, through the samples of a layered depth cube.
    Cube,
}

/// Light from all around, by cosine-weighted rays a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ambient {
    /// The environment's, as far as no near surface is in the way. Surfaces beyond the radius, in metres, occlude nothing; it is a
    /// share of the scene's diagonal where not given.
    Occlusion(NonZeroU32, Option<f32>),
    /// The environment's, and what the surfaces that rays meet send back: their emission, and one diffuse bounce of lamps.
    Indirect(NonZeroU32),
}

/// A text that names no lighting.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming variants")]
pub enum UnknownLighting {
    #[error(
        "unknown lighting {0:?}, expected terms of unlit, phong, shadows, soft N, soft NxN [by rays|maps|samples|cube], occlusion N, occlusion N RADIUSm, indirect N, reflections N and glossy N with commas between them"
    )]
    Term(String),
    #[error("lighting {0:?}: {1} must be from 1 to {2}")]
    Count(String, &'static str, u32),
    #[error("lighting {0:?}: the radius must be a positive number")]
    Radius(String),
    #[error("lighting {0:?}: {1}")]
    Conflict(String, &'static str),
}

impl Lighting {
    /// Base colours as they are.
    pub const UNLIT: Self = Self { direct: Direct::Unlit, ambient: None, reflections: None, glossy: None };

    /// Whether anything arrives at surfaces.
    #[must_use]
    pub fn is_lit(&self) -> bool {
        self.direct != Direct::Unlit
    }

    /// Whether rays are traced.
    #[must_use]
    pub fn is_traced(&self) -> bool {
        self.shadow_rays() > 0 || self.ambient.is_some()
    }

    /// Rays a light and pixel.
    #[must_use]
    pub fn shadow_rays(&self) -> u32 {
        match self.direct {
            Direct::Unlit | Direct::Phong => 0,
            Direct::Shadows => 1,
            Direct::Soft(rays) => rays.get(),
            Direct::Grid(side, _) => side.get() * side.get(),
        }
    }

    /// Places along a side of the grid on every lamp; 0 for other light.
    #[must_use]
    pub fn grid_side(&self) -> u32 {
        if let Direct::Grid(side, _) = self.direct { side.get() } else { 0 }
    }

    /// How the places of a grid are found; by rays for light without one.
    #[must_use]
    pub fn grid_visibility(&self) -> GridVisibility {
        if let Direct::Grid(_, visibility) = self.direct { visibility } else { GridVisibility::Rays }
    }

    /// Rays a pixel of the light from all around.
    #[must_use]
    pub fn ambient_rays(&self) -> u32 {
        match self.ambient {
            Some(Ambient::Occlusion(rays, _) | Ambient::Indirect(rays)) => rays.get(),
            None => 0,
        }
    }

    /// Whether light that surfaces send back is traced.
    #[must_use]
    pub fn is_indirect(&self) -> bool {
        matches!(self.ambient, Some(Ambient::Indirect(_)))
    }

    /// The radius of occlusion, where one is given.
    #[must_use]
    pub fn occlusion_radius_m(&self) -> Option<f32> {
        if let Some(Ambient::Occlusion(_, radius_m)) = self.ambient { radius_m } else { None }
    }

    /// The mirrors that a ray meets.
    #[must_use]
    pub fn reflections(&self) -> u32 {
        self.reflections.map_or(0, NonZeroU32::get)
    }

    /// Rays of a lobe a pixel.
    #[must_use]
    pub fn glossy_rays(&self) -> u32 {
        self.glossy.map_or(0, NonZeroU32::get)
    }

    /// Without mirror images of the scene, sharp or glossy; `None` where there are none.
    #[must_use]
    pub fn without_reflections(&self) -> Option<Self> {
        let is_reflected = self.reflections.or(self.glossy).is_some();
        is_reflected.then_some(Self { reflections: None, glossy: None, ..*self })
    }

    /// A quarter of the rays, at least one each; `None` where there are no fewer.
    #[must_use]
    pub fn with_fewer_rays(&self) -> Option<Self> {
        let lighting = self.with_rays(quarter_of);
        (lighting != *self).then_some(lighting)
    }

    /// With half the rays so many times, at least one each.
    #[must_use]
    pub fn with_rays_halved(&self, times: u32) -> Self {
        self.with_rays(|rays| NonZeroU32::new(rays.get() >> times).unwrap_or(NonZeroU32::MIN))
    }

    /// No more than so many rays of each kind a pixel.
    #[must_use]
    pub fn with_at_most_rays(&self, most: NonZeroU32) -> Self {
        self.with_rays(|rays| rays.min(most))
    }

    /// With other numbers of rays.
    fn with_rays(&self, rays: impl Fn(NonZeroU32) -> NonZeroU32) -> Self {
        let direct = match self.direct {
            Direct::Soft(to_lamps) => Direct::Soft(rays(to_lamps)),
            Direct::Grid(side, visibility) => match side_of_square(rays(side.saturating_mul(side))) {
                // The middle of the lamp needs no map.
                NonZeroU32::MIN => Direct::Shadows,
                fewer => Direct::Grid(fewer, visibility),
            },
            other => other,
        };
        let ambient = self.ambient.map(|ambient| match ambient {
            Ambient::Occlusion(number, radius_m) => Ambient::Occlusion(rays(number), radius_m),
            Ambient::Indirect(number) => Ambient::Indirect(rays(number)),
        });
        Self { direct, ambient, ..*self }
    }

    /// The light of points that no sample knows: a quarter of the rays but at least [`LEAST_RAYS_HERE`], or [`LEAST_RAYS_IN_MOTION`]
    /// below `balanced`, and all of them at the finest quality. Such points are few, and they lie where light changes, so that noise
    /// is hard to see there.
    #[must_use]
    pub(crate) fn for_unknown_points(&self, quality: LightCacheQuality) -> Self {
        if quality >= LightCacheQuality::Fine {
            return *self;
        }
        let least = if quality < LightCacheQuality::Balanced { LEAST_RAYS_IN_MOTION } else { LEAST_RAYS_HERE };
        self.with_rays(|rays| rays.min(quarter_of(rays).max(least)))
    }

    /// The formula of highlights; none for unlit surfaces.
    #[must_use]
    pub fn highlight(&self) -> Option<Highlight> {
        match self.direct {
            Direct::Unlit => None,
            Direct::Phong => Some(Highlight::BlinnPhong),
            Direct::Shadows | Direct::Soft(_) | Direct::Grid(..) => Some(Highlight::Ggx),
        }
    }

    /// Steps in which a static scene's light grows from one ray to all: each doubles what was there.
    #[must_use]
    pub fn refinement_steps(&self) -> u32 {
        self.shadow_rays().max(self.ambient_rays()).max(1).next_power_of_two().ilog2() + 1
    }
}

impl FromStr for Lighting {
    type Err = UnknownLighting;
    fn from_str(text: &str) -> Result<Self, UnknownLighting> {
        let mut direct = None;
        let mut ambient = None;
        let mut reflections = None;
        let mut glossy = None;
        for term in text.split(',').map(str::trim) {
            let words: Vec<&str> = term.split_whitespace().collect();
            let again = match words[..] {
                ["unlit"] => direct.replace(Direct::Unlit).is_some(),
                ["phong"] => direct.replace(Direct::Phong).is_some(),
                ["shadows"] => direct.replace(Direct::Shadows).is_some(),
                ["soft", n] if !n.contains('x') => {
                    direct.replace(Direct::Soft(count(text, n, "rays", MAX_RAYS)?)).is_some()
                }
                ["soft", n] => direct.replace(Direct::Grid(grid_side(text, n)?, GridVisibility::Rays)).is_some(),
                ["soft", n, "by", visibility] => {
                    let named = GridVisibility::named(visibility);
                    let visibility = named.ok_or_else(|| UnknownLighting::Term(term.to_owned()))?;
                    direct.replace(Direct::Grid(grid_side(text, n)?, visibility)).is_some()
                }
                ["occlusion", n] => {
                    ambient.replace(Ambient::Occlusion(count(text, n, "rays", MAX_RAYS)?, None)).is_some()
                }
                ["occlusion", n, radius] => {
                    let radius_m = radius.strip_suffix('m').unwrap_or(radius).parse().ok();
                    let radius_m = radius_m.filter(|radius_m: &f32| radius_m.is_finite() && *radius_m > 0.0);
                    let radius_m = radius_m.ok_or_else(|| UnknownLighting::Radius(text.to_owned()))?;
                    ambient.replace(Ambient::Occlusion(count(text, n, "rays", MAX_RAYS)?, Some(radius_m))).is_some()
                }
                ["indirect", n] => ambient.replace(Ambient::Indirect(count(text, n, "rays", MAX_RAYS)?)).is_some(),
                ["reflections", n] => reflections.replace(count(text, n, "reflections", MAX_REFLECTIONS)?).is_some(),
                ["glossy", n] => glossy.replace(count(text, n, "rays of glossy", MAX_GLOSSY_RAYS)?).is_some(),
                _ => return Err(UnknownLighting::Term(term.to_owned())),
            };
            if again {
                let is_ambient = ["occlusion", "indirect"].contains(&words[0]);
                let reason = if is_ambient {
                    "occlusion and indirect are one light, which is said once"
                } else {
                    "says one thing twice"
                };
                return Err(UnknownLighting::Conflict(text.to_owned(), reason));
            }
        }
        let lighting = Self { direct: direct.unwrap_or_default(), ambient, reflections, glossy };
        let conflict = if lighting.is_indirect() && lighting.shadow_rays() == 0 {
            "indirect light needs shadows or soft N: phong and unlit have none of lamps"
        } else if !lighting.is_lit() && ambient.is_some() {
            "unlit surfaces have no occlusion"
        } else if lighting.shadow_rays() == 0 && lighting.without_reflections().is_some() {
            "mirrors show the scene under shadows and soft N only"
        } else {
            return Ok(lighting);
        };
        Err(UnknownLighting::Conflict(text.to_owned(), conflict))
    }
}

fn count(text: &str, number: &str, what: &'static str, most: u32) -> Result<NonZeroU32, UnknownLighting> {
    let count = number.parse().ok().filter(|count: &NonZeroU32| count.get() <= most);
    count.ok_or_else(|| UnknownLighting::Count(text.to_owned(), what, most))
}

/// The side of a square grid, as in `16x16`.
fn grid_side(text: &str, sides: &str) -> Result<NonZeroU32, UnknownLighting> {
    let what = "points along each side of a grid NxN, with N";
    let (columns, rows) = sides.split_once('x').unwrap_or((sides, ""));
    if columns != rows {
        return Err(UnknownLighting::Conflict(text.to_owned(), "a grid has as many columns as rows"));
    }
    count(text, columns, what, MAX_GRID_SIDE)
}

/// The side of the largest square of no more than so many places.
fn side_of_square(places: NonZeroU32) -> NonZeroU32 {
    NonZeroU32::new(places.get().isqrt()).unwrap_or(NonZeroU32::MIN)
}

impl GridVisibility {
    /// All with their words.
    const NAMES: [(Self, &str); 4] =
        [(Self::Rays, "rays"), (Self::Maps, "maps"), (Self::Samples, "samples"), (Self::Cube, "cube")];

    /// Whether each place of a rectangle has a shadow map.
    pub(crate) fn has_maps(self) -> bool {
        matches!(self, Self::Maps | Self::Samples)
    }

    fn named(word: &str) -> Option<Self> {
        Self::NAMES.into_iter().find(|(_, name)| *name == word).map(|(visibility, _)| visibility)
    }

    fn name(self) -> &'static str {
        Self::NAMES.into_iter().find(|(visibility, _)| *visibility == self).map_or("rays", |(_, name)| name)
    }
}

/// A quarter of a number of rays, at least one.
fn quarter_of(rays: NonZeroU32) -> NonZeroU32 {
    NonZeroU32::new(rays.get() / 4).unwrap_or(NonZeroU32::MIN)
}

impl fmt::Display for Lighting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.direct {
            Direct::Unlit => write!(f, "unlit")?,
            Direct::Phong => write!(f, "phong")?,
            Direct::Shadows => write!(f, "shadows")?,
            Direct::Soft(rays) => write!(f, "soft {rays}")?,
            Direct::Grid(side, GridVisibility::Rays) => write!(f, "soft {side}x{side}")?,
            Direct::Grid(side, visibility) => write!(f, "soft {side}x{side} by {}", visibility.name())?,
        }
        match self.ambient {
            Some(Ambient::Occlusion(rays, Some(radius_m))) => write!(f, ", occlusion {rays} {radius_m}m")?,
            Some(Ambient::Occlusion(rays, None)) => write!(f, ", occlusion {rays}")?,
            Some(Ambient::Indirect(rays)) => write!(f, ", indirect {rays}")?,
            None => {}
        }
        if let Some(reflections) = self.reflections {
            write!(f, ", reflections {reflections}")?;
        }
        if let Some(rays) = self.glossy {
            write!(f, ", glossy {rays}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip() {
        for name in [
            "unlit",
            "phong",
            "shadows",
            "soft 16",
            "soft 16, occlusion 16",
            "phong, occlusion 4 0.5m",
            "shadows, occlusion 8",
            "soft 16, indirect 64",
            "shadows, indirect 1, reflections 2",
            "shadows, reflections 8",
            "soft 16, occlusion 16, reflections 2",
            "shadows, glossy 256",
            "soft 16, occlusion 16, reflections 2, glossy 16",
            "soft 16x16",
            "soft 32x32 by maps, occlusion 16",
            "soft 1x1 by samples",
            "soft 32x32 by cube",
        ] {
            assert_eq!(name.parse::<Lighting>().expect(name).to_string(), name);
        }
        assert_eq!("soft 4x4 by rays".parse::<Lighting>().expect("a grid").to_string(), "soft 4x4");
        assert_eq!("occlusion 4".parse::<Lighting>().expect("alone").to_string(), "phong, occlusion 4");
    }

    #[test]
    fn invalid_lightings_are_refused_with_the_reason() {
        use UnknownLighting::{Conflict, Count, Radius, Term};
        let parsed = |text: &str| text.parse::<Lighting>().expect_err(text);
        for text in
            ["soft 0", "soft -1", "soft 4097", "soft many", "occlusion 0", "soft 99999999999", "soft 4, indirect 0"]
        {
            assert!(matches!(parsed(text), Count(_, "rays", MAX_RAYS)), "{text}");
        }
        for text in ["shadows, reflections 0", "shadows, reflections 9", "shadows, reflections -1"] {
            assert!(matches!(parsed(text), Count(_, "reflections", MAX_REFLECTIONS)), "{text}");
        }
        for text in ["shadows, glossy 0", "shadows, glossy 257", "shadows, glossy -1"] {
            assert!(matches!(parsed(text), Count(_, "rays of glossy", MAX_GLOSSY_RAYS)), "{text}");
        }
        for text in [
            "",
            "soft",
            "reflections",
            "glossy",
            "bright",
            "unlit;phong",
            "occlusion",
            "occlusion 1 2 3",
            "soft 4, adaptive",
        ] {
            assert!(matches!(parsed(text), Term(_)), "{text}");
        }
        for text in ["soft 0x0", "soft 33x33", "soft x", "soft -1x-1", "soft 4x4x"] {
            assert!(matches!(parsed(text), Count(..) | Conflict(..)), "{text}");
        }
        assert!(parsed("soft 16x8").to_string().contains("as many columns as rows"));
        assert!(matches!(parsed("soft 16x16 by guess"), Term(_)) && matches!(parsed("soft 16 by"), Term(_)));
        for text in ["occlusion 4 -1m", "occlusion 4 NaN", "occlusion 4 0m"] {
            assert!(matches!(parsed(text), Radius(_)), "{text}");
        }
        let unmirrored = ["phong, reflections 1", "unlit, reflections 1", "reflections 2", "glossy 4"];
        let twice = ["unlit, phong", "occlusion 4, occlusion 8", "shadows, reflections 1, reflections 1"];
        for text in [&unmirrored[..], &twice, &["unlit, occlusion 4"]].concat() {
            assert!(matches!(parsed(text), Conflict(..)), "{text}");
        }
        for text in ["unlit, indirect 4", "phong, indirect 4", "indirect 4", "soft 4, occlusion 4, indirect 4"] {
            assert!(parsed(text).to_string().contains("indirect"), "{text}");
        }
    }

    #[test]
    fn lighting_without_reflections_has_no_glossy_ones_either() {
        let plain =
            |text: &str| text.parse::<Lighting>().expect(text).without_reflections().map(|plain| plain.to_string());
        for text in ["soft 4, reflections 2", "soft 4, glossy 8", "soft 4, reflections 2, glossy 8"] {
            assert_eq!(plain(text).as_deref(), Some("soft 4"), "{text}");
        }
        assert_eq!(plain("soft 4"), None);
    }

    #[test]
    fn unknown_points_have_a_quarter_of_the_rays_but_no_fewer_than_16() {
        let here = |text: &str, quality| text.parse::<Lighting>().expect(text).for_unknown_points(quality).to_string();
        let balanced = LightCacheQuality::Balanced;
        assert_eq!(here("soft 128, occlusion 256 2m", balanced), "soft 32, occlusion 64 2m");
        assert_eq!(here("soft 32, occlusion 8", balanced), "soft 16, occlusion 8");
        assert_eq!(here("shadows, occlusion 64, reflections 2", balanced), "shadows, occlusion 16, reflections 2");
        assert_eq!(here("soft 128, occlusion 64", LightCacheQuality::Fine), "soft 128, occlusion 64");
        assert_eq!(here("soft 128, occlusion 8", LightCacheQuality::Fast), "soft 32, occlusion 4");
        assert_eq!(here("soft 16x16 by maps", balanced), "soft 8x8 by maps");
        let preview = |text: &str| text.parse::<Lighting>().expect(text).with_at_most_rays(NonZeroU32::MIN).to_string();
        assert_eq!(preview("soft 16x16 by samples, occlusion 4"), "shadows, occlusion 1");
    }

    #[test]
    fn refinement_steps_double_the_rays() {
        let steps = |text: &str| text.parse::<Lighting>().expect(text).refinement_steps();
        assert_eq!(
            [steps("phong"), steps("shadows"), steps("soft 1"), steps("soft 16"), steps("soft 17")],
            [1, 1, 1, 5, 6]
        );
        assert_eq!(steps("soft 4, occlusion 16"), 5);
    }
}
