//! A walk along each ray through the samples of a layered depth cube.

use std::ops::RangeInclusive;

use depth_image::{Highlight, MAX_REFLECTIONS};
use gpu::{Binding, DynamicUniforms, ShaderVariant};
use minijinja::{Value, context};

use crate::bounce::{Bounces, CellRays, RayLists};
use crate::cube::Cube;
use crate::lobes::{self, GlossyList, LobeSum};
use crate::reflectors::{LobeLight, Reflection};
use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording};

/// The rays that are walked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Walked {
    /// Those of all pixels.
    Pixels,
    /// Those of pixels that another method leaves: the cube is the base beside its images.
    LeftPixels,
    /// Those off mirrors. Where the cube is a base, those of mirrors in no mirror cell.
    Bounced,
    /// Those into lobes, and off the mirrors that they meet.
    IntoLobes,
    /// Those off mirrors whose end the images of a mirror cell leave unknown: the cube is the base.
    LeftBounced,
}

impl Walked {
    const ALL: [Self; 5] = [Self::Pixels, Self::LeftPixels, Self::Bounced, Self::IntoLobes, Self::LeftBounced];

    /// The ways to light the lobes that the rays meet.
    fn lobes(self) -> &'static [LobeLight] {
        match self {
            Self::Pixels => &LobeLight::ALL,
            Self::LeftPixels => &[LobeLight::SentRest, LobeLight::Sent],
            Self::Bounced => &[LobeLight::GatheredMirrors],
            Self::IntoLobes | Self::LeftBounced => &[],
        }
    }

    fn is_bounced(self) -> bool {
        matches!(self, Self::Bounced | Self::IntoLobes | Self::LeftBounced)
    }

    fn is_left(self) -> bool {
        matches!(self, Self::LeftPixels | Self::LeftBounced)
    }
}

/// The switches of `layered.wgsl`.
#[derive(Debug)]
pub(crate) struct Walk {
    set: SetVariant,
    rays: Walked,
    /// The cube is the base beside a view's images.
    in_base: bool,
    /// What a ray does not meet may be a surface that the cube does not hold.
    truncated: bool,
    reflection: Reflection,
}

impl Walk {
    fn of(
        recording: &Recording<'_>,
        cube: &Cube,
        rays: Walked,
        spawning: Option<&Bounces<'_>>,
        lobe: Option<LobeLight>,
    ) -> Self {
        let has_map = recording.set.environment.is_some();
        let in_base = recording.set.cube.is_none();
        let mirror_cells = spawning.map(|bounces| bounces.cells.len());
        // Mirrors of a matt base are not in it.
        let of_cube = Reflection::of(cube.reflectors.as_ref(), mirror_cells, lobe, has_map);
        let environment_map = of_cube.environment_map || in_base && rays.is_bounced() && has_map;
        // Rays off mirrors see no image of the view's set.
        let set = if rays.is_bounced() { SetVariant::CUBE } else { recording.set.variant() };
        let reflection = Reflection { environment_map, ..of_cube };
        Self { set, rays, in_base, truncated: cube.truncated, reflection }
    }
}

impl ShaderVariant for Walk {
    const TEMPLATE: &'static str = "layered.wgsl";
    const DYNAMIC_UNIFORMS: DynamicUniforms = ONE_VIEW;

    fn context(&self) -> Value {
        context! {
            bounced => self.rays.is_bounced(),
            left => self.rays.is_left(),
            listed => self.rays != Walked::Pixels,
            in_base => self.in_base,
            into_lobes => self.rays == Walked::IntoLobes,
            truncated => self.truncated,
            ..self.reflection.context(self.set)
        }
    }

    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for rays in Walked::ALL {
            let set = SetVariant { cameras: if rays == Walked::LeftPixels { 4 } else { 0 }, holes: false };
            let all_lit = Reflection::all().into_iter();
            for reflection in all_lit.filter(|lit| !rays.is_bounced() || lit.highlight != Some(Highlight::BlinnPhong)) {
                for reflection in reflection.with_lobes(rays.lobes()) {
                    for truncated in [false, true] {
                        all.push(Self { set, rays, in_base: truncated || rays.is_left(), truncated, reflection });
                    }
                }
            }
        }
        all
    }
}

/// Records the walk of all pixels, and of the rays off the mirrors that they show, of which `followed` are followed before what the next
/// one shows is gathered; then of rays into lobes. Gives the pixels that stay unknown.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    bounces: Option<&Bounces<'_>>,
    followed: Option<u32>,
) -> Result<PixelList, ReconstructionError> {
    let Some(cube) = recording.set.cube.clone() else { return Ok(recording.empty_list()) };
    let mirrors = bounces.map_or(0, |bounces| bounces.reflections);
    let followed = followed.map_or(mirrors, |followed| followed.min(mirrors));
    let is_glossy = bounces.is_some_and(|bounces| bounces.glossy_rays > 0);
    let lobe = LobeLight::of_pixels(followed, mirrors, is_glossy, cube.light_field.is_some());
    let sent = bounces.filter(|_| lobe.is_some_and(LobeLight::is_sent));
    let sent = sent.and_then(|bounces| GlossyList::of(recording, bounces));
    let first = bounces.filter(|_| followed > 0).map(|bounces| bounces.next(recording.device, None));
    let undecided = walk_pixels(recording, &cube, None, bounces.zip(first.as_ref()), lobe, sent.as_ref())?;
    let Some(bounces) = bounces else { return Ok(undecided) };
    if let Some(first) = first {
        let gathered = (followed < mirrors).then_some(LobeLight::GatheredMirrors);
        follow_mirrors(recording, &cube, bounces, first, Ends { gathered, lobes: None }, 1..=followed)?;
    }
    if let Some(glossy) = &sent {
        follow_lobes(recording, &cube, bounces, glossy)?;
    }
    Ok(undecided)
}

/// Records the walks of rays into the lobes of listed surfaces, one ray of each after another, and adds their light to the pixels.
pub(crate) fn follow_lobes(
    recording: &mut Recording<'_>,
    cube: &Cube,
    bounces: &Bounces<'_>,
    glossy: &GlossyList<'_>,
) -> Result<(), ReconstructionError> {
    let Some(reflectors) = cube.reflectors.as_ref().or(recording.set.reflectors.as_ref()) else { return Ok(()) };
    for number in 0..glossy.rays {
        let first = lobes::record(recording, bounces, glossy, number, &reflectors.illumination)?;
        // Costs are learned by generation, and are others than those of rays off mirrors.
        let generations = MAX_REFLECTIONS + 1..=MAX_REFLECTIONS + bounces.reflections.max(1);
        follow_mirrors(recording, cube, bounces, first, Ends { gathered: None, lobes: Some(glossy) }, generations)?;
    }
    recording.dispatch_listed(&LobeSum, glossy.bindings(), &glossy.list, 0, ())
}

/// Records the walk of listed rays, and of those off the mirrors that they meet; what the last mirrors show may be gathered.
fn follow_mirrors(
    recording: &mut Recording<'_>,
    cube: &Cube,
    bounces: &Bounces<'_>,
    first: RayLists,
    ends: Ends<'_>,
    generations: RangeInclusive<u32>,
) -> Result<(), ReconstructionError> {
    let walked = if ends.lobes.is_some() { Walked::IntoLobes } else { Walked::Bounced };
    bounces.each_mirror(recording, first, generations, |recording, rays| {
        let gathered = ends.gathered.filter(|_| rays.next.is_none());
        follow(recording, cube, bounces, rays, walked, Ends { gathered, ..ends })
    })
}

/// Records the walk of all pixels or, in the cube beside its images, of those that another method leaves. Mirrors list the rays
/// off them, and rough surfaces are listed where their lobes are sent rays. Gives the pixels that stay unknown.
pub(crate) fn walk_pixels(
    recording: &mut Recording<'_>,
    cube: &Cube,
    listed: Option<&PixelList>,
    mirrored: Option<(&Bounces<'_>, &RayLists)>,
    lobe: Option<LobeLight>,
    sent: Option<&GlossyList<'_>>,
) -> Result<PixelList, ReconstructionError> {
    let undecided = recording.empty_list();
    let rays = if listed.is_some() { Walked::LeftPixels } else { Walked::Pixels };
    let variant = Walk::of(recording, cube, rays, mirrored.map(|(bounces, _)| bounces), lobe);
    let mut own = cube.bindings();
    own.extend(undecided.written_bindings());
    own.extend(mirrored.into_iter().flat_map(|(bounces, next)| bounces.spawn_bindings(next)));
    own.extend(sent.into_iter().flat_map(GlossyList::bindings));
    recording.dispatch_pixels(&variant, own, listed)?;
    Ok(undecided)
}

/// What becomes of the light at the ends of rays.
#[derive(Clone, Copy, Default)]
pub(crate) struct Ends<'g> {
    /// What mirrors show there.
    gathered: Option<LobeLight>,
    /// It is summed up, where rays go into lobes.
    lobes: Option<&'g GlossyList<'g>>,
}

/// Records the walk of listed rays off mirrors or into lobes, whose light is added to their pixels.
pub(crate) fn follow(
    recording: &mut Recording<'_>,
    cube: &Cube,
    bounces: &Bounces<'_>,
    rays: CellRays<'_>,
    walked: Walked,
    ends: Ends<'_>,
) -> Result<(), ReconstructionError> {
    let variant = Walk::of(recording, cube, walked, rays.next.map(|_| bounces), ends.gathered);
    let [_, _, ray_provenance] = &bounces.planes;
    let mut own = cube.bindings();
    own.extend([Binding::buffer("work", &bounces.works[rays.cell]), Binding::buffer("ray_provenance", ray_provenance)]);
    own.extend(bounces.list_bindings(rays.lists));
    own.extend(rays.next.into_iter().flat_map(|next| bounces.spawn_bindings(next)));
    own.extend(ends.lobes.into_iter().flat_map(GlossyList::bindings));
    recording.dispatch_listed(&variant, own, &rays.lists.lists, rays.cell, (rays.cell, rays.reflection))
}
