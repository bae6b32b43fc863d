//! Adds the light that depends on the viewer to pixels that show a surface.

use depth_image::Highlight;
use gpu::{Binding, GpuEnvironment, ResourceTraits, ShaderVariant, highlight_name, light_slots};
use minijinja::{Value, context};

use crate::bounce::{Bounces, MAX_RAY_LISTS, RayLists};
use crate::lobes::{GlossyList, LobeLight};
use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording, reflectors::sample_texels};

/// The switches of `specular.wgsl`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Specular {
    set: SetVariant,
    highlight: Highlight,
    lights: usize,
    /// The environment is a map.
    environment_map: bool,
    /// Only listed pixels are lit.
    listed: bool,
    /// The words that say which lights a sample sees; 0 where all samples see all.
    visibility_words: usize,
    /// Mirrors list their rays; the number of lists.
    mirror_cells: Option<usize>,
    /// Rough surfaces are listed, which are to send rays.
    lists_glossy: bool,
}

impl ShaderVariant for Specular {
    const TEMPLATE: &'static str = "specular.wgsl";
    const TRAITS: ResourceTraits = ONE_VIEW;

    fn context(&self) -> Value {
        context! {
            single_pole => false,
            highlight => highlight_name(self.highlight),
            light_slots => light_slots(self.lights),
            environment_map => self.environment_map,
            visibility_words => self.visibility_words,
            listed => self.listed,
            sample_texels => sample_texels(self.visibility_words),
            mirrors => self.mirror_cells.is_some() || self.lists_glossy,
            spawns => self.mirror_cells.is_some(),
            mirror_cells => self.mirror_cells.unwrap_or(0),
            lists_glossy => self.lists_glossy,
            glossy => self.lists_glossy,
            lobe_share => LobeLight::sent(self.mirror_cells.is_some()).share(),
            ..self.set.context()
        }
    }

    fn all() -> Vec<Self> {
        let kinds = [(Highlight::BlinnPhong, false), (Highlight::Ggx, false), (Highlight::Ggx, true)];
        let lights = [(0, 0), (0, 1), (3, 0), (3, 1), (9, 3), (255, 64)];
        let mut all = Vec::new();
        for set in SetVariant::all() {
            for (highlight, environment_map) in kinds {
                for (lights, visibility_words) in lights {
                    let matt = Self {
                        set,
                        highlight,
                        lights,
                        environment_map,
                        listed: false,
                        visibility_words,
                        mirror_cells: None,
                        lists_glossy: false,
                    };
                    // Pixels that show mirrors are found anew at each position, not listed.
                    all.push(Self { listed: true, ..matt });
                    let is_ggx = highlight == Highlight::Ggx;
                    let mirrored = [Some(1), Some(MAX_RAY_LISTS)].into_iter().filter(|_| is_ggx);
                    for mirror_cells in std::iter::once(None).chain(mirrored) {
                        let with = Self { mirror_cells, ..matt };
                        all.push(with);
                        all.extend((is_ggx && lights <= 3).then_some(Self { lists_glossy: true, ..with }));
                    }
                }
            }
        }
        all
    }
}

/// Highlights are added after the fill, which would spread them. Mirrors list their rays, where they are to be followed, and rough
/// surfaces are listed, where their lobes are sent rays.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    listed: Option<&PixelList>,
    mirrored: Option<(&Bounces<'_>, &RayLists)>,
    glossy: Option<&GlossyList<'_>>,
) -> Result<(), ReconstructionError> {
    let Some(reflectors) = &recording.set.reflectors else { return Ok(()) };
    let environment = recording.set.environment.as_deref().filter(|_| reflectors.highlight == Highlight::Ggx);
    let variant = Specular {
        set: recording.set.variant(),
        highlight: reflectors.highlight,
        lights: reflectors.lights,
        // Blinn-Phong surfaces mirror lamps only.
        environment_map: environment.is_some(),
        listed: listed.is_some(),
        visibility_words: reflectors.visibility_words,
        mirror_cells: mirrored.map(|(bounces, _)| bounces.cells.len()),
        lists_glossy: glossy.is_some(),
    };
    let [color, inverse_depth, provenance] = recording.batch.pixel_planes();
    let mut bindings = recording.cell_bindings();
    bindings.extend([
        Binding::buffer("out_color", color),
        Binding::buffer("inverse_depth", inverse_depth),
        Binding::buffer("provenance", provenance),
        Binding::buffer("illumination", &reflectors.illumination),
        Binding::texture("samples", &reflectors.samples),
    ]);
    bindings.extend(environment.into_iter().flat_map(GpuEnvironment::bindings));
    bindings.extend(listed.into_iter().flat_map(PixelList::bindings));
    bindings.extend(mirrored.into_iter().flat_map(|(bounces, next)| bounces.spawn_bindings(next)));
    bindings.extend(glossy.into_iter().flat_map(GlossyList::bindings));
    let pass = recording.bind(&variant, bindings)?;
    recording.dispatch_pixels(&pass, listed);
    Ok(())
}
