//! Light of lamps and the environment, summed over rays.

use depth_image::Highlight;
use gpu::{Binding, ShaderVariant, highlight_name, switches};
use minijinja::{Value, context, value::merge_maps};
use wgpu::Buffer;

use crate::rays::Traversal;
use crate::{
    Direct, GridVisibility, RenderError,
    batch::{Batch, Part, Recording},
    pixel_list::PixelList,
    reflections::bounces::Rays,
    sums::SumPlanes,
    surfaces::Surfaces,
};

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Illuminate {
    by_rays: bool,
    /// The pixels' own rays lie around a pole.
    single_pole: bool,
    listed: bool,
    /// Ambient light of the pixels at the list's end is in the sums already.
    knows_ambient: bool,
    /// Lit are listed points, such as those where mirrored rays end, not pixels.
    bounces: bool,
    /// Lamps have rays: one to the middle.
    shadows: bool,
    /// As many rays as the uniform says are spread over each lamp.
    soft: bool,
    /// The places are those of a regular grid.
    grid: bool,
    /// Which of them are seen is known.
    bits: bool,
    /// Rays look for surfaces that occlude the environment.
    ambient: bool,
    /// They bring what surfaces send back, too.
    indirect: bool,
    /// Light is added to sums of earlier rays.
    continued: bool,
    sums: SumPlanes,
    /// The environment is a map.
    environment_map: bool,
    /// Present where rays are traced.
    traversal: Option<Traversal>,
}

impl ShaderVariant for Illuminate {
    const TEMPLATE: &'static str = "illuminate.wgsl";

    fn context(&self) -> Value {
        let Self { by_rays, single_pole, listed, knows_ambient, bounces, continued, environment_map, .. } = *self;
        let Self { shadows, soft, grid, bits, ambient, indirect, .. } = *self;
        context! {
            by_rays, single_pole, listed, knows_ambient, bounces, continued, environment_map, shadows, soft, grid, bits, ambient, indirect,
            writes_bits => false,
            traced => self.traversal.is_some(),
            primary => indirect,
            from_eye => false,
            shading => highlight_name(Highlight::Ggx),
            ..merge_maps([self.sums.context(), self.traversal.map(Traversal::context).unwrap_or_default()])
        }
    }

    fn all() -> Vec<Self> {
        let mut lit = Vec::new();
        for [by_rays, listed, bounces, continued, environment_map, shadows, soft, ambient, indirect] in switches() {
            let plain = Self { by_rays, listed, bounces, continued, environment_map, ..Self::default() };
            lit.push(Self { shadows, soft, ambient, indirect, ..plain });
        }
        // Points have a list of their own, and indirect light is that of lamps with rays.
        lit.retain(|variant| !(variant.bounces && (variant.by_rays || variant.listed)));
        lit.retain(|variant| variant.shadows || !(variant.soft || variant.indirect));
        lit.retain(|variant| variant.ambient || !variant.indirect);
        let grids = lit.iter().filter(|variant| variant.soft).flat_map(|variant| {
            let bits = [false, true].into_iter().filter(|bits| !(bits & variant.bounces));
            bits.map(|bits| Self { grid: true, bits, ..*variant })
        });
        lit.extend(grids.collect::<Vec<_>>());
        let indirect = lit.iter().filter(|variant| variant.listed && variant.soft && variant.indirect);
        let indirect = indirect.map(|variant| Self { knows_ambient: true, ..*variant });
        let bent = lit.iter().filter(|variant| variant.by_rays && !variant.continued && !variant.environment_map);
        let bent = bent.filter(|variant| !variant.indirect && [variant.shadows, variant.soft] == [variant.ambient; 2]);
        let bent = bent.map(|variant| Self { single_pole: true, ..*variant });
        lit.iter().copied().chain(indirect).chain(bent).flat_map(Self::with_all_sums).collect()
    }
}

impl Illuminate {
    /// With each kind of sums, and with each traversal where rays are traced.
    fn with_all_sums(self) -> impl Iterator<Item = Self> {
        let is_traced = self.shadows || self.ambient;
        SumPlanes::all().flat_map(move |sums| {
            Traversal::ALL.map(|traversal| Self { sums, traversal: is_traced.then_some(traversal), ..self })
        })
    }

    /// The variant for all pixels of a batch.
    fn of(batch: &Batch<'_>) -> Self {
        let lighting = batch.work.lighting;
        let traced = batch.traced.as_deref().filter(|_| lighting.is_traced());
        Self {
            by_rays: batch.by_rays,
            single_pole: batch.is_single_pole(),
            shadows: lighting.shadow_rays() > 0,
            soft: matches!(lighting.direct, Direct::Soft(_) | Direct::Grid(..)),
            grid: lighting.grid_side() > 0,
            bits: lighting.grid_visibility() != GridVisibility::Rays,
            ambient: lighting.ambient.is_some(),
            indirect: lighting.is_indirect(),
            sums: batch.output.sums,
            environment_map: batch.work.scene.environment.is_some(),
            traversal: traced.map(|traced| traced.traversal),
            ..Self::default()
        }
    }
}

/// Records one dispatch for each piece of these cameras and part of the rays. Lit are the pixels of a list for each piece of
/// the one camera, or else all.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    parts: &[Part],
    first: usize,
    surfaces: &[Surfaces],
    lists: Option<&[PixelList]>,
) -> Result<(), RenderError> {
    let batch = recording.batch;
    for (number, part) in parts.iter().enumerate() {
        let continued = number > 0 || recording.sums.rays.iter().any(|rays| rays.start > 0);
        let of_batch = Illuminate::of(batch);
        let knows_ambient = batch.cached.is_some() && of_batch.indirect;
        let variant = Illuminate { listed: lists.is_some(), knows_ambient, continued, ..of_batch };
        for (camera, target) in (first..).zip(surfaces) {
            let Some(lists) = lists else {
                let own = [Binding::buffer("camera", &part.cameras)].into_iter().chain(target.bindings());
                let bound = recording.bind(&variant, part.counts, own)?;
                recording.dispatch(&bound, camera);
                continue;
            };
            for (piece, list) in recording.pieces_of(camera).into_iter().zip(lists) {
                let own = [Binding::buffer("camera", &part.cameras)].into_iter().chain(target.bindings());
                let bound = recording.bind(&variant, part.counts, own.chain(list.bindings()))?;
                recording.dispatch_piece(&bound, piece, list.size());
            }
        }
    }
    Ok(())
}

/// Records the light that arrives at the ends of mirrored rays, in parts of the rays of light.
pub(crate) fn record_points(
    recording: &mut Recording<'_>,
    parts: &[Part],
    points: &Rays,
    sums: &Buffer,
) -> Result<(), RenderError> {
    for (number, part) in parts.iter().enumerate() {
        let of_batch = Illuminate::of(recording.batch);
        // Maps are asked for pixels alone.
        let variant = Illuminate { by_rays: false, bounces: true, bits: false, continued: number > 0, ..of_batch };
        let own = [Binding::buffer("camera", &part.cameras), Binding::buffer("sums", sums)];
        let own = own.into_iter().chain(points.bindings());
        let bound = recording.bind(&variant, (part.counts, points.generation), own)?;
        points.dispatch(recording, &bound);
    }
    Ok(())
}
