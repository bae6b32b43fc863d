//! A walk along each ray through the samples of a layered depth cube.

use std::ops::RangeInclusive;

use depth_image::{Highlight, MAX_REFLECTIONS};
use gpu::{Binding, GpuEnvironment, ResourceTraits, ShaderVariant, highlight_name, light_slots, switches};
use minijinja::{Value, context};

use crate::bounce::{Bounces, CellRays, MAX_RAY_LISTS, RayLists};
use crate::cube::{Cube, LightField};
use crate::lobes::{self, GlossyList, LobeLight};
use crate::reflectors::sample_texels;
use crate::surface::found_bindings;
use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording};

/// The rays that are walked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Walked {
    /// Those of all pixels.
    #[default]
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
    fn is_bounced(self) -> bool {
        matches!(self, Self::Bounced | Self::IntoLobes | Self::LeftBounced)
    }

    fn is_left(self) -> bool {
        matches!(self, Self::LeftPixels | Self::LeftBounced)
    }
}

/// The switches of `layered.wgsl`.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Walk {
    set: SetVariant,
    rays: Walked,
    /// The cube is the base beside a view's images.
    in_base: bool,
    /// What a ray does not meet may be a surface that the cube does not hold.
    truncated: bool,
    /// The formula of highlights, where samples have any.
    highlight: Option<Highlight>,
    /// Mirrors list the rays off them; the number of lists.
    mirror_cells: Option<usize>,
    lobe: Option<LobeLight>,
    lights: usize,
    environment_map: bool,
    visibility_words: usize,
}

impl Walk {
    fn of(
        recording: &Recording<'_>,
        cube: &Cube,
        rays: Walked,
        spawning: Option<&Bounces<'_>>,
        lobe: Option<LobeLight>,
    ) -> Self {
        let reflectors = cube.reflectors.as_ref();
        let highlight = reflectors.map(|reflectors| reflectors.highlight);
        let in_base = recording.set.cube.is_none();
        // Blinn-Phong surfaces mirror lamps only.
        let is_mapped =
            (highlight == Some(Highlight::Ggx) || in_base && rays.is_bounced()) && recording.set.environment.is_some();
        // Rays off mirrors see no image of the view's set.
        let set = if rays.is_bounced() { SetVariant::CUBE } else { recording.set.variant() };
        Self {
            set,
            rays,
            in_base,
            truncated: cube.truncated,
            highlight,
            // Mirrors of a matt base are not in it.
            mirror_cells: spawning.filter(|_| highlight == Some(Highlight::Ggx)).map(|bounces| bounces.cells.len()),
            lobe: lobe.filter(|_| highlight == Some(Highlight::Ggx)),
            lights: reflectors.map_or(0, |reflectors| reflectors.lights),
            environment_map: is_mapped,
            visibility_words: reflectors.map_or(0, |reflectors| reflectors.visibility_words),
        }
    }

    /// The same in a base, beside four images.
    fn of_base(self) -> Vec<Self> {
        let mirror_cells = self.mirror_cells.map(|_| MAX_RAY_LISTS);
        let base = Self { in_base: true, mirror_cells, ..self };
        match self.rays {
            Walked::Pixels | Walked::LeftPixels => {
                vec![Self { rays: Walked::LeftPixels, set: SetVariant { cameras: 4, ..self.set }, ..base }]
            }
            Walked::Bounced | Walked::LeftBounced => {
                [Walked::Bounced, Walked::LeftBounced].map(|rays| Self { rays, ..base }).to_vec()
            }
            Walked::IntoLobes => vec![Self { in_base: true, ..self }],
        }
    }

    /// The same with all ways to light lobes.
    fn with_lobes(self) -> impl Iterator<Item = Self> {
        let may_gather = self.rays != Walked::IntoLobes;
        let shows_all = !self.rays.is_bounced();
        let lobes = LobeLight::ALL.into_iter();
        let lobes = lobes.filter(move |&lobe| may_gather && (shows_all || lobe == LobeLight::GatheredMirrors));
        lobes.map(move |lobe| {
            let follows = matches!(lobe, LobeLight::GatheredRest | LobeLight::SentRest);
            Self { mirror_cells: follows.then_some(1), lobe: Some(lobe), ..self }
        })
    }
}

impl ShaderVariant for Walk {
    const TEMPLATE: &'static str = "layered.wgsl";
    const TRAITS: ResourceTraits = ONE_VIEW;

    fn context(&self) -> Value {
        context! {
            bounced => self.rays.is_bounced(),
            left => self.rays.is_left(),
            in_base => self.in_base,
            into_lobes => self.rays == Walked::IntoLobes,
            truncated => self.truncated,
            reflects => self.highlight.is_some(),
            highlight => highlight_name(self.highlight.unwrap_or(Highlight::Ggx)),
            mirrors => self.mirror_cells.is_some() || self.lobe.is_some(),
            spawns => self.mirror_cells.is_some(),
            gathers => self.lobe.is_some_and(|lobe| !lobe.is_sent()),
            lists_glossy => self.lobe.is_some_and(LobeLight::is_sent),
            lobe_share => self.lobe.map_or("0.0", LobeLight::share),
            glossy => self.lobe.is_some_and(|lobe| lobe != LobeLight::GatheredMirrors),
            mirror_cells => self.mirror_cells.unwrap_or(0),
            light_slots => light_slots(self.lights),
            environment_map => self.environment_map,
            visibility_words => self.visibility_words,
            sample_texels => sample_texels(self.visibility_words),
            single_pole => false,
            ..self.set.context()
        }
    }

    fn all() -> Vec<Self> {
        let mut all = [false, true].map(|truncated| Self { truncated, ..Self::default() }).to_vec();
        for (lights, visibility_words) in [(0, 0), (3, 1), (255, 64)] {
            for [truncated, environment_map] in switches() {
                let with = Self { truncated, lights, visibility_words, ..Self::default() };
                for rays in [Walked::Pixels, Walked::Bounced, Walked::IntoLobes] {
                    let ggx = Self { rays, highlight: Some(Highlight::Ggx), environment_map, ..with };
                    all.extend([ggx, Self { mirror_cells: Some(1), ..ggx }]);
                    all.extend(ggx.with_lobes());
                }
                let blinn_phong = Self { highlight: Some(Highlight::BlinnPhong), ..with };
                all.extend((!environment_map).then_some(blinn_phong));
            }
        }
        let left = all.iter().filter(|walk| walk.lights <= 3 && walk.lobe.is_none()).flat_map(|walk| walk.of_base());
        let left: Vec<Self> = left.collect();
        all.extend(left);
        for [truncated, environment_map] in switches() {
            let without_reflectors = Self { in_base: true, truncated, environment_map, ..Self::default() };
            let bounced = [Walked::Bounced, Walked::IntoLobes, Walked::LeftBounced];
            all.extend(bounced.map(|rays| Self { rays, ..without_reflectors }));
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
    lobes::record_sum(recording, glossy)
}

/// Records the walk of listed rays, and of those off the mirrors that they meet; what the last mirrors show may be gathered.
fn follow_mirrors(
    recording: &mut Recording<'_>,
    cube: &Cube,
    bounces: &Bounces<'_>,
    mut lists: RayLists,
    ends: Ends<'_>,
    generations: RangeInclusive<u32>,
) -> Result<(), ReconstructionError> {
    let walked = if ends.lobes.is_some() { Walked::IntoLobes } else { Walked::Bounced };
    for generation in generations.clone() {
        let next = (generation < *generations.end()).then(|| bounces.next(recording.device, Some(&lists)));
        let gathered = ends.gathered.filter(|_| next.is_none());
        let rays = CellRays { lists: &lists, next: next.as_ref(), cell: 0, reflection: generation };
        follow(recording, cube, bounces, rays, walked, Ends { gathered, ..ends })?;
        let Some(next) = next else { break };
        lists = next;
    }
    Ok(())
}

/// Records the walk of pixels that another method leaves, in the cube beside its images. Mirrors list the rays off them, and rough
/// surfaces are listed where their lobes are sent rays. Gives those that stay unknown.
pub(crate) fn record_left(
    recording: &mut Recording<'_>,
    base: &Cube,
    left: &PixelList,
    mirrored: Option<(&Bounces<'_>, &RayLists)>,
    glossy: Option<&GlossyList<'_>>,
) -> Result<PixelList, ReconstructionError> {
    let lobe = glossy.map(|_| LobeLight::sent(mirrored.is_some()));
    walk_pixels(recording, base, Some(left), mirrored, lobe, glossy)
}

fn walk_pixels(
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
    let mut bindings = recording.view_bindings();
    bindings.extend(shared_bindings(recording, cube, &variant));
    bindings.extend(found_bindings(recording.batch.pixel_planes(), &undecided));
    bindings.extend(listed.into_iter().flat_map(PixelList::bindings));
    let spawning = mirrored.filter(|_| variant.mirror_cells.is_some());
    bindings.extend(spawning.into_iter().flat_map(|(bounces, next)| bounces.spawn_bindings(next)));
    bindings.extend(sent.filter(|_| variant.lobe.is_some()).into_iter().flat_map(GlossyList::bindings));
    let pass = recording.bind(&variant, bindings)?;
    recording.dispatch_pixels(&pass, listed);
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
    let mut bindings = shared_bindings(recording, cube, &variant);
    let [_, _, ray_provenance] = &bounces.planes;
    bindings.extend([
        Binding::buffer("work", &bounces.works[rays.cell]),
        ends.lobes.map_or(Binding::buffer("out_color", &recording.batch.color), |glossy| {
            Binding::buffer("lobe_light", glossy.light)
        }),
        Binding::buffer("out_provenance", &recording.batch.provenance),
    ]);
    bindings.extend(walked.is_left().then(|| Binding::buffer("ray_provenance", ray_provenance)));
    bindings.extend(bounces.list_bindings(rays.lists));
    let next = rays.next.filter(|_| variant.mirror_cells.is_some());
    bindings.extend(next.into_iter().flat_map(|next| bounces.spawn_bindings(next)));
    let pass = recording.bind(&variant, bindings)?;
    recording.dispatch_listed(&pass, &rays.lists.lists, rays.cell, (rays.cell, rays.reflection));
    Ok(())
}

fn shared_bindings<'b>(recording: &'b Recording<'_>, cube: &'b Cube, variant: &Walk) -> Vec<Binding<'b>> {
    let mut bindings: Vec<Binding<'b>> = cube.bindings().into_iter().collect();
    let light_field = cube.light_field.as_ref().filter(|_| variant.lobe.is_some_and(|lobe| !lobe.is_sent()));
    bindings.extend(light_field.into_iter().flat_map(LightField::bindings));
    // A base may be too coarse to hold the mirrors of the view's images, or anything that reflects.
    let lit = cube.reflectors.as_ref().or(recording.set.reflectors.as_ref().filter(|_| variant.rays.is_bounced()));
    bindings.extend(lit.map(|reflectors| Binding::buffer("illumination", &reflectors.illumination)));
    bindings.extend(cube.reflectors.as_ref().map(|reflectors| Binding::texture("samples", &reflectors.samples)));
    let map = recording.set.environment.as_deref().filter(|_| variant.environment_map);
    bindings.extend(map.into_iter().flat_map(GpuEnvironment::bindings));
    bindings
}
