//! A walk along each ray through the samples of a layered depth cube.

use depth_image::{Highlight, MAX_MIRROR_CELLS};
use gpu::{Binding, GpuEnvironment, ResourceTraits, ShaderVariant, highlight_name, light_slots, switches};
use minijinja::{Value, context};

use crate::bounce::{Bounces, RayLists};
use crate::cube::{Cube, LightField};
use crate::reflectors::sample_texels;
use crate::surface::found_bindings;
use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording};

/// The rays that are walked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Walked {
    /// Those of all pixels.
    Pixels,
    /// Those of pixels that another method leaves: the cube is the base beside its images.
    LeftPixels,
    /// Those off mirrors.
    Bounced,
    /// Those off mirrors whose end the images of a mirror cell leave unknown: the cube is the base.
    LeftBounced,
}

impl Walked {
    fn is_bounced(self) -> bool {
        matches!(self, Self::Bounced | Self::LeftBounced)
    }

    fn is_left(self) -> bool {
        matches!(self, Self::LeftPixels | Self::LeftBounced)
    }
}

/// What is gathered in a light field of what surfaces mirror.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Gather {
    /// What smooth ones mirror.
    Mirrors,
    /// What no ray off a mirror brings.
    Rest,
    /// All.
    All,
}

impl Gather {
    const ALL: [Self; 3] = [Self::Mirrors, Self::Rest, Self::All];

    /// For the surfaces that pixels show. `followed` of `mirrors` are followed; rough surfaces may be glossy.
    fn of_pixels(followed: u32, mirrors: u32, glossy: bool) -> Option<Self> {
        match (followed == 0 && mirrors > 0, glossy) {
            (true, true) => Some(Self::All),
            (true, false) => Some(Self::Mirrors),
            (false, true) => Some(if mirrors > 0 { Self::Rest } else { Self::All }),
            (false, false) => None,
        }
    }

    /// In a shader, of a mirror.
    fn share(self) -> &'static str {
        match self {
            Self::Mirrors => "mirror_share(mirror.reflector.roughness)",
            Self::Rest => "1.0 - mirror_share(mirror.reflector.roughness)",
            Self::All => "1.0",
        }
    }
}

/// The switches of `layered.wgsl`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Walk {
    set: SetVariant,
    rays: Walked,
    /// What a ray does not meet may be a surface that the cube does not hold.
    truncated: bool,
    /// The formula of highlights, where samples have any.
    highlight: Option<Highlight>,
    /// Mirrors list the rays off them; the number of lists.
    mirror_cells: Option<usize>,
    gather: Option<Gather>,
    lights: usize,
    environment_map: bool,
    visibility_words: usize,
}

impl Walk {
    const PLAIN: Self = Self {
        set: SetVariant::CUBE,
        rays: Walked::Pixels,
        truncated: false,
        highlight: None,
        mirror_cells: None,
        gather: None,
        lights: 0,
        environment_map: false,
        visibility_words: 0,
    };

    fn of(
        recording: &Recording<'_>,
        cube: &Cube,
        rays: Walked,
        (spawning, gather): (Option<&Bounces<'_>>, Option<Gather>),
    ) -> Self {
        let reflectors = cube.reflectors.as_ref();
        let highlight = reflectors.map(|reflectors| reflectors.highlight);
        // Blinn-Phong surfaces mirror lamps only.
        let is_mapped =
            (highlight == Some(Highlight::Ggx) || rays == Walked::LeftBounced) && recording.set.environment.is_some();
        // Rays off mirrors see no image of the view's set.
        let set = if rays.is_bounced() { SetVariant::CUBE } else { recording.variant() };
        Self {
            set,
            rays,
            truncated: cube.truncated,
            highlight,
            // Mirrors of a matt base are not in it.
            mirror_cells: spawning.filter(|_| highlight == Some(Highlight::Ggx)).map(Bounces::cell_count),
            gather: gather.filter(|_| highlight == Some(Highlight::Ggx)),
            lights: reflectors.map_or(0, |reflectors| reflectors.lights),
            environment_map: is_mapped,
            visibility_words: reflectors.map_or(0, |reflectors| reflectors.visibility_words),
        }
    }
}

impl Walk {
    /// The same in a base, beside four images.
    fn of_base(self) -> Self {
        let mirror_cells = self.mirror_cells.map(|_| MAX_MIRROR_CELLS);
        match self.rays {
            Walked::Pixels | Walked::LeftPixels => {
                Self { rays: Walked::LeftPixels, set: SetVariant { cameras: 4, ..self.set }, mirror_cells, ..self }
            }
            Walked::Bounced | Walked::LeftBounced => Self { rays: Walked::LeftBounced, mirror_cells, ..self },
        }
    }
}

impl Walk {
    /// The same with all that may be gathered.
    fn gathering(self) -> impl Iterator<Item = Self> {
        let kinds = Gather::ALL.into_iter().filter(move |&kind| kind == Gather::Mirrors || !self.rays.is_bounced());
        kinds.map(move |kind| Self { mirror_cells: (kind == Gather::Rest).then_some(1), gather: Some(kind), ..self })
    }
}

impl ShaderVariant for Walk {
    const TEMPLATE: &'static str = "layered.wgsl";
    const TRAITS: ResourceTraits = ONE_VIEW;

    fn context(&self) -> Value {
        context! {
            bounced => self.rays.is_bounced(),
            left => self.rays.is_left(),
            truncated => self.truncated,
            reflects => self.highlight.is_some(),
            highlight => highlight_name(self.highlight.unwrap_or(Highlight::Ggx)),
            mirrors => self.mirror_cells.or(self.gather.map(|_| 0)).is_some(),
            spawns => self.mirror_cells.is_some(),
            gathers => self.gather.is_some(),
            gathered_share => self.gather.map_or("0.0", Gather::share),
            glossy => matches!(self.gather, Some(Gather::Rest | Gather::All)),
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
        let lights = [(0, 0), (3, 1), (255, 64)];
        let matt = switches().map(|[count_fetches, truncated]| Self {
            set: SetVariant { count_fetches, ..SetVariant::CUBE },
            truncated,
            ..Self::PLAIN
        });
        let glossy = lights.into_iter().flat_map(|(lights, visibility_words)| {
            switches().flat_map(move |[count_fetches, truncated, environment_map]| {
                let set = SetVariant { count_fetches, ..SetVariant::CUBE };
                let with = Self { set, truncated, lights, visibility_words, ..Self::PLAIN };
                let ggx = Self { highlight: Some(Highlight::Ggx), environment_map, ..with };
                let bounced = (!count_fetches).then_some(Self { rays: Walked::Bounced, ..ggx });
                let blinn_phong = (!environment_map).then_some(Self { highlight: Some(Highlight::BlinnPhong), ..with });
                let mirrored = [Some(ggx), bounced].into_iter().flatten();
                let each =
                    |walk: Self| [walk, Self { mirror_cells: Some(1), ..walk }].into_iter().chain(walk.gathering());
                mirrored.flat_map(each).chain(blinn_phong)
            })
        });
        let own: Vec<Self> = matt.chain(glossy).collect();
        let left = own.iter().filter(|walk| walk.lights <= 3 && walk.gather.is_none()).map(|walk| walk.of_base());
        let without_reflectors = switches().map(|[truncated, environment_map]| Self {
            rays: Walked::LeftBounced,
            truncated,
            environment_map,
            ..Self::PLAIN
        });
        own.iter().copied().chain(left).chain(without_reflectors).collect()
    }
}

/// Records the walk of all pixels, and of the rays off the mirrors that they show, of which `followed` are followed before what the next
/// one shows is gathered. Gives the pixels that stay unknown.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    bounces: Option<&Bounces<'_>>,
    followed: Option<u32>,
) -> Result<PixelList, ReconstructionError> {
    let undecided = recording.empty_list();
    let Some(cube) = recording.set.cube.clone() else { return Ok(undecided) };
    let mirrors = bounces.map_or(0, Bounces::reflections);
    let followed = followed.map_or(mirrors, |followed| followed.min(mirrors));
    let glossy = bounces.is_some_and(Bounces::are_glossy) && cube.light_field.is_some();
    let next_of = |recording: &Recording<'_>, before: Option<&RayLists>, reflection: u32| {
        bounces.filter(|_| reflection < followed).map(|bounces| bounces.next(recording.device, before))
    };
    let mut next = next_of(recording, None, 0);
    let gather = Gather::of_pixels(followed, mirrors, glossy);
    walk_pixels(recording, &cube, (None, &undecided), (bounces.zip(next.as_ref()), gather))?;
    let Some(bounces) = bounces else { return Ok(undecided) };
    for reflection in 1..=followed {
        let Some(lists) = next else { break };
        next = next_of(recording, Some(&lists), reflection);
        let gather = (reflection == followed && followed < mirrors).then_some(Gather::Mirrors);
        let rays = (Walked::Bounced, gather);
        follow(recording, (&cube, rays), bounces, (&lists, next.as_ref()), (0, reflection))?;
    }
    Ok(undecided)
}

/// Records the walk of pixels that another method leaves, in the cube beside its images. Gives those that stay unknown.
pub(crate) fn record_left(
    recording: &mut Recording<'_>,
    base: &Cube,
    left: &PixelList,
    mirrored: Option<(&Bounces<'_>, &RayLists)>,
) -> Result<PixelList, ReconstructionError> {
    let undecided = recording.empty_list();
    walk_pixels(recording, base, (Some(left), &undecided), (mirrored, None))?;
    Ok(undecided)
}

/// Records the walk of rays off mirrors whose end the images of a mirror cell leave unknown, in the cube beside them.
pub(crate) fn follow_left(
    recording: &mut Recording<'_>,
    base: &Cube,
    bounces: &Bounces<'_>,
    lists: (&RayLists, Option<&RayLists>),
    place: (usize, u32),
) -> Result<(), ReconstructionError> {
    follow(recording, (base, (Walked::LeftBounced, None)), bounces, lists, place)
}

fn walk_pixels(
    recording: &mut Recording<'_>,
    cube: &Cube,
    (listed, undecided): (Option<&PixelList>, &PixelList),
    (mirrored, gather): (Option<(&Bounces<'_>, &RayLists)>, Option<Gather>),
) -> Result<(), ReconstructionError> {
    let rays = if listed.is_some() { Walked::LeftPixels } else { Walked::Pixels };
    let variant = Walk::of(recording, cube, rays, (mirrored.map(|(bounces, _)| bounces), gather));
    let pass = recording.device.passes.get(&variant)?;
    let mut bindings = recording.view_bindings();
    bindings.extend(shared_bindings(recording, cube, &variant));
    bindings.extend(found_bindings(recording, undecided));
    bindings.extend(listed.into_iter().flat_map(PixelList::bindings));
    let spawning = mirrored.filter(|_| variant.mirror_cells.is_some());
    bindings.extend(spawning.into_iter().flat_map(|(bounces, next)| bounces.spawn_bindings(next)));
    let bound = pass.bind(0, bindings)?;
    recording.dispatch_pixels(&variant, &pass, &bound, listed);
    Ok(())
}

/// Records the walk of rays off one mirror of a mirror cell, whose light is added to their pixels.
fn follow(
    recording: &mut Recording<'_>,
    (cube, (rays, gather)): (&Cube, (Walked, Option<Gather>)),
    bounces: &Bounces<'_>,
    (lists, next): (&RayLists, Option<&RayLists>),
    (cell, reflection): (usize, u32),
) -> Result<(), ReconstructionError> {
    let variant = Walk::of(recording, cube, rays, (next.map(|_| bounces), gather));
    let pass = recording.device.passes.get(&variant)?;
    let mut bindings = shared_bindings(recording, cube, &variant);
    let [_, _, ray_provenance] = bounces.planes();
    bindings.extend([
        bounces.work_binding(cell),
        Binding::buffer("out_color", &recording.batch.color),
        Binding::buffer("out_provenance", &recording.batch.provenance),
    ]);
    bindings.extend(rays.is_left().then(|| Binding::buffer("ray_provenance", ray_provenance)));
    bindings.extend(bounces.list_bindings(lists));
    let next = next.filter(|_| variant.mirror_cells.is_some());
    bindings.extend(next.into_iter().flat_map(|next| bounces.spawn_bindings(next)));
    let bound = pass.bind(0, bindings)?;
    recording.dispatch_listed(&variant, &pass, &bound, (bounces.lists_of(lists), cell), (cell, reflection));
    Ok(())
}

fn shared_bindings<'b>(recording: &'b Recording<'_>, cube: &'b Cube, variant: &Walk) -> Vec<Binding<'b>> {
    let mut bindings: Vec<Binding<'b>> = cube.bindings().into_iter().collect();
    let light_field = cube.light_field.as_ref().filter(|_| variant.gather.is_some());
    bindings.extend(light_field.into_iter().flat_map(LightField::bindings));
    // A base may be too coarse to hold the mirrors of the view's images, or anything that reflects.
    let lit = cube.reflectors.as_ref().or(recording.set.reflectors.as_ref().filter(|_| variant.rays.is_bounced()));
    bindings.extend(lit.map(|reflectors| Binding::buffer("illumination", &reflectors.illumination)));
    bindings.extend(cube.reflectors.as_ref().map(|reflectors| Binding::texture("samples", &reflectors.samples)));
    let map = recording.set.environment.as_deref().filter(|_| variant.environment_map);
    bindings.extend(map.into_iter().flat_map(GpuEnvironment::bindings));
    bindings
}
