//! A walk along each ray through the samples of a layered depth cube.

use std::sync::Arc;

use depth_image::Highlight;
use gpu::{Binding, GpuEnvironment, ResourceTraits, ShaderVariant, highlight_name, light_slots, switches};
use minijinja::{Value, context};

use crate::bounce::{Bounces, RayLists};
use crate::cube::Cube;
use crate::reflectors::sample_texels;
use crate::surface::found_bindings;
use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording};

/// The switches of `layered.wgsl`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Walk {
    set: SetVariant,
    /// Rays are those off mirrors, not those of the view.
    bounced: bool,
    /// What a ray does not meet may be a surface that the cube does not hold.
    truncated: bool,
    /// The formula of highlights, where samples have any.
    highlight: Option<Highlight>,
    /// Mirrors list the rays off them.
    mirrors: bool,
    lights: usize,
    environment_map: bool,
    visibility_words: usize,
}

impl Walk {
    const PLAIN: Self = Self {
        set: SetVariant::CUBE,
        bounced: false,
        truncated: false,
        highlight: None,
        mirrors: false,
        lights: 0,
        environment_map: false,
        visibility_words: 0,
    };

    fn of(recording: &Recording<'_>, cube: &Cube, bounced: bool, mirrors: bool) -> Self {
        let reflectors = cube.reflectors.as_ref();
        let highlight = reflectors.map(|reflectors| reflectors.highlight);
        // Blinn-Phong surfaces mirror lamps only.
        let is_mapped = highlight == Some(Highlight::Ggx) && recording.set.environment.is_some();
        let count_fetches = !bounced && recording.batch.fetches.is_some();
        Self {
            set: SetVariant { count_fetches, ..recording.set.variant() },
            bounced,
            truncated: cube.truncated,
            highlight,
            mirrors,
            lights: reflectors.map_or(0, |reflectors| reflectors.lights),
            environment_map: is_mapped,
            visibility_words: reflectors.map_or(0, |reflectors| reflectors.visibility_words),
        }
    }
}

impl ShaderVariant for Walk {
    const TEMPLATE: &'static str = "layered.wgsl";
    const TRAITS: ResourceTraits = ONE_VIEW;

    fn context(&self) -> Value {
        context! {
            bounced => self.bounced,
            truncated => self.truncated,
            reflects => self.highlight.is_some(),
            highlight => highlight_name(self.highlight.unwrap_or(Highlight::Ggx)),
            mirrors => self.mirrors,
            mirror_cells => usize::from(self.mirrors),
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
                let bounced = (!count_fetches).then_some(Self { bounced: true, ..ggx });
                let blinn_phong = (!environment_map).then_some(Self { highlight: Some(Highlight::BlinnPhong), ..with });
                let mirrored = [Some(ggx), bounced].into_iter().flatten();
                mirrored.flat_map(|walk| [walk, Self { mirrors: true, ..walk }]).chain(blinn_phong)
            })
        });
        matt.chain(glossy).collect()
    }
}

/// Records the walk of all pixels, and of the rays off the mirrors that they show. Gives the pixels that stay unknown.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    bounces: Option<&Bounces<'_>>,
) -> Result<PixelList, ReconstructionError> {
    let undecided = recording.empty_list();
    let Some(cube) = recording.set.cube.clone() else { return Ok(undecided) };
    let mut next = bounces.map(|bounces| bounces.next(recording.device, None));
    let variant = Walk::of(recording, &cube, false, next.is_some());
    let pass = recording.device.passes.get(&variant)?;
    let mut bindings = recording.view_bindings();
    bindings.extend(shared_bindings(recording, &cube, &variant));
    bindings.extend(found_bindings(recording, &undecided));
    bindings.extend(bounces.zip(next.as_ref()).into_iter().flat_map(|(bounces, next)| bounces.spawn_bindings(next)));
    let bound = pass.bind(0, bindings)?;
    recording.dispatch_pixels(&variant, &pass, &bound, None);
    let Some(bounces) = bounces else { return Ok(undecided) };
    for reflection in 1..=bounces.reflections() {
        let Some(lists) = next else { break };
        next = (reflection < bounces.reflections()).then(|| bounces.next(recording.device, Some(&lists)));
        follow(recording, &cube, bounces, (&lists, next.as_ref()), reflection)?;
    }
    Ok(undecided)
}

/// Records the walk of rays off one mirror, whose light is added to their pixels.
fn follow(
    recording: &mut Recording<'_>,
    cube: &Arc<Cube>,
    bounces: &Bounces<'_>,
    (lists, next): (&RayLists, Option<&RayLists>),
    reflection: u32,
) -> Result<(), ReconstructionError> {
    let variant = Walk::of(recording, cube, true, next.is_some());
    let pass = recording.device.passes.get(&variant)?;
    let mut bindings = shared_bindings(recording, cube, &variant);
    bindings.extend([
        bounces.work_binding(0),
        Binding::buffer("out_color", &recording.batch.color),
        Binding::buffer("out_provenance", &recording.batch.provenance),
    ]);
    bindings.extend(bounces.list_bindings(lists));
    bindings.extend(next.into_iter().flat_map(|next| bounces.spawn_bindings(next)));
    let bound = pass.bind(0, bindings)?;
    recording.dispatch_listed(&variant, &pass, &bound, (bounces.lists_of(lists), 0), reflection);
    Ok(())
}

fn shared_bindings<'b>(recording: &'b Recording<'_>, cube: &'b Cube, variant: &Walk) -> Vec<Binding<'b>> {
    let mut bindings: Vec<Binding<'b>> = cube.bindings().into_iter().collect();
    if let Some(reflectors) = &cube.reflectors {
        bindings.push(Binding::buffer("illumination", &reflectors.illumination));
        bindings.push(Binding::texture("samples", &reflectors.samples));
    }
    let map = recording.set.environment.as_deref().filter(|_| variant.environment_map);
    bindings.extend(map.into_iter().flat_map(GpuEnvironment::bindings));
    bindings
}
