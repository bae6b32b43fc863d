//! Rasterising with reversed depth, infinitely far: inverse depth comes out of the depth buffer exact.

use std::{ops::Range, sync::Arc};

use bytemuck::{Pod, Zeroable};
use depth_image::{Highlight, ParallelCamera, PinholeCamera};
use glam::{UVec2, Vec4};
use gpu::{
    Binding, BoundGroup, DrawPass, DrawState, DrawVariant, Frame, Gpu, PassCache, ShaderVariant, Templates, WorkKind,
    highlight_name, switches, uniform_stride,
};
use minijinja::{Value, context};
use scene::{Vertex, VertexDetail};

use crate::gpu_scene::{GpuObject, MaterialTraits};
use crate::known_samples::{Predecessors, RedundancyVariant};
use crate::surfaces::{NOTHING, SURFACE_FORMAT, SURFACE_ID_FORMAT, Surfaces, TRIANGLE_NORMAL_FORMAT};
use crate::{
    GpuScene, RenderError, batch::Recording, cluster::Frustum, pixel_camera::uniform, redundancy_test::RedundancyTest,
    work::DrawWork,
};

/// The group of known samples, or of the memory of what lines meet.
const OWN_GROUP: u32 = 3;
/// The variables of the textures in the order of [`scene::Material::textures`], and of their samplers.
const TEXTURES: [(&str, &str); 5] = [
    ("base_color_texture", "base_color_sampler"),
    ("metallic_roughness_texture", "metallic_roughness_sampler"),
    ("normal_texture", "normal_sampler"),
    ("emissive_texture", "emissive_sampler"),
    ("occlusion_texture", "occlusion_sampler"),
];
/// The indices of a slice of a scene whose cost is unknown.
const UNKNOWN_SLICE_INDICES: u64 = 3 << 14;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub(crate) struct RasterVariant {
    material: MaterialTraits,
    /// `None` shows colours as they are.
    shading: Option<Highlight>,
    surface_id: bool,
    triangle_normal: bool,
    depth_only: bool,
    wind: bool,
    redundancy: Option<RedundancyVariant>,
    /// Triangles are drawn from behind, whatever their material is.
    both_faces: bool,
    /// All that the lines of a parallel camera meet is kept.
    pub appended: bool,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct RasterCamera {
    pub clip_from_world: [[f32; 4]; 4],
    pub eye_in_world: [f32; 3],
    pub scene_time_s: f32,
    pub near_m: f32,
    pub footprint: f32,
    pub padding: [u32; 2],
}

/// The resources of all draws of a submission.
struct Groups {
    scene: BoundGroup,
    object: BoundGroup,
    textures: Vec<BoundGroup>,
    /// Known samples, or the memory of what lines meet.
    own: Option<BoundGroup>,
}

pub(crate) struct Raster {
    gpu: Arc<Gpu>,
    passes: PassCache<DrawPass>,
}

impl RasterVariant {
    /// The variants of one material with each redundancy test that needs no rays.
    pub fn with_tests(tests: &[RedundancyTest]) -> impl Iterator<Item = Self> {
        let tests: Vec<_> = tests.iter().copied().filter(|test| !test.traces_rays()).collect();
        let bases: Vec<_> =
            Self::all().into_iter().filter(|variant| !variant.depth_only && !variant.appended).rev().take(4).collect();
        let tests = RedundancyVariant::all(&tests).into_iter();
        tests.flat_map(move |test| bases.clone().into_iter().map(move |base| Self { redundancy: Some(test), ..base }))
    }

    /// Of a plain material, without any plane beside the surface.
    fn of(work: &DrawWork<'_>) -> Self {
        let both_faces = work.both_faces;
        Self { shading: work.lighting.highlight(), wind: work.scene.wind, both_faces, ..Self::default() }
    }

    fn has_own_group(&self) -> bool {
        self.redundancy.is_some() || self.appended
    }
}

impl ShaderVariant for RasterVariant {
    const TEMPLATE: &'static str = "raster.wgsl";

    fn context(&self) -> Value {
        let Self { material, shading, surface_id, triangle_normal, depth_only, wind, redundancy, both_faces, appended } =
            *self;
        let MaterialTraits { double_sided, alpha_tested, textured, coat_textured, unlit, specular, mapped } = material;
        context! {
            surface_id, triangle_normal, depth_only, wind, both_faces, appended,
            double_sided, alpha_tested, textured, unlit, specular, mapped,
            shading => shading.map_or("unlit", highlight_name),
            coat_textured => coat_textured && shading == Some(Highlight::Ggx),
            ..RedundancyVariant::context(redundancy, OWN_GROUP)
        }
    }

    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for shading in [None, Some(Highlight::BlinnPhong), Some(Highlight::Ggx)] {
            for material in MaterialTraits::all() {
                let plain = Self { material, shading, ..Self::default() };
                for [surface_id, wind, triangle_normal, depth_only, appended] in switches() {
                    all.push(Self { surface_id, wind, triangle_normal, depth_only, appended, ..plain });
                }
            }
        }
        all.retain(|variant| !(variant.triangle_normal && (variant.depth_only || variant.appended)));
        all.retain(|variant| !(variant.appended && (variant.depth_only || variant.surface_id)));
        all
    }
}

impl DrawVariant for RasterVariant {
    fn state(&self) -> DrawState {
        let mut color_formats = Vec::new();
        color_formats.extend((!self.depth_only && !self.appended).then_some(SURFACE_FORMAT));
        color_formats.extend((!self.depth_only && self.surface_id).then_some(SURFACE_ID_FORMAT));
        color_formats.extend((!self.depth_only && self.triangle_normal).then_some(TRIANGLE_NORMAL_FORMAT));
        let cull_mode = (!self.material.double_sided && !self.both_faces && !self.appended).then_some(wgpu::Face::Back);
        let details = self.material.mapped.then(|| layout::<VertexDetail>(&DETAIL_ATTRIBUTES));
        let vertices = [layout::<Vertex>(&VERTEX_ATTRIBUTES)].into_iter().chain(details).collect();
        DrawState { vertices, cull_mode, color_formats, nearest_only: !self.appended }
    }
}

impl Raster {
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self { gpu: gpu.clone(), passes: PassCache::new(gpu, templates) }
    }

    /// Records one pass for each camera from the `first` on. With predecessors, whose samples are not drawn again, there is one
    /// camera, and a pass before it draws the nearest depth: a test that noted what it discards would write memory, and no
    /// fragment could be spared it by its depth.
    pub fn record(
        &self,
        recording: &mut Recording<'_>,
        first: usize,
        surfaces: &[Surfaces],
        predecessors: Option<&Predecessors>,
    ) -> Result<(), RenderError> {
        let Recording { batch, frame, .. } = recording;
        let scene = batch.work.scene;
        let shown = RasterVariant {
            surface_id: surfaces.iter().any(|target| target.surface_ids.is_some()),
            triangle_normal: batch.output.triangle_normal,
            redundancy: predecessors.map(|images| images.variant),
            ..RasterVariant::of(&batch.work)
        };
        let front = RasterVariant { depth_only: true, redundancy: None, ..shown };
        let cameras = &batch.cameras[first..][..surfaces.len()];
        let of_pinholes = cameras.iter().map(|camera| RasterCamera::of(camera.reference(), batch.work.scene_time_s));
        let groups = self.groups(scene, shown, of_pinholes, predecessors.map(|images| images.bindings().to_vec()))?;
        let posed = scene.motion.as_ref().map(|motion| motion.at(batch.work.scene_time_s));
        let posed = posed.as_ref().map(|posed| posed.buffers(&self.gpu));
        for (place, (camera, target)) in (0..).zip(cameras.iter().zip(surfaces)) {
            let frustum = Frustum::of(camera.reference());
            let size_px = camera.size_px();
            let view = View { scene, posed, place, size_px, frustum, groups: groups.as_ref() };
            if predecessors.is_some() {
                self.draw_in_slices(frame, &view, front, &[], &target.views.front_depth)?;
            }
            let planes = target.surface_ids.iter().chain(&target.views.triangle_normals);
            let colors: Vec<_> = std::iter::once(&target.views.surfaces).chain(planes).collect();
            self.draw_in_slices(frame, &view, shown, &colors, &target.views.reversed_depth)?;
        }
        Ok(())
    }

    /// Records the depth of what each camera sees, from both sides.
    pub fn record_maps(
        &self,
        frame: &mut Frame<'_>,
        work: &DrawWork<'_>,
        cameras: &[PinholeCamera],
        reversed_depths: &[wgpu::TextureView],
    ) -> Result<(), RenderError> {
        let scene = work.scene;
        let variant = RasterVariant { depth_only: true, both_faces: true, ..RasterVariant::of(work) };
        let all = cameras.iter().map(|camera| RasterCamera::of(camera, work.scene_time_s));
        let groups = self.groups(scene, variant, all, None)?;
        let posed = scene.motion.as_ref().map(|motion| motion.at(work.scene_time_s));
        let posed = posed.as_ref().map(|posed| posed.buffers(&self.gpu));
        for (place, (camera, reversed_depth)) in (0..).zip(cameras.iter().zip(reversed_depths)) {
            let frustum = Frustum::of(camera);
            let view = View { scene, posed, place, size_px: camera.size_px, frustum, groups: groups.as_ref() };
            self.draw_in_slices(frame, &view, variant, &[], reversed_depth)?;
        }
        Ok(())
    }

    /// Records what the lines of a parallel camera meet. `depth` has the camera's size; it tests nothing.
    pub fn record_lines(
        &self,
        frame: &mut Frame<'_>,
        work: &DrawWork<'_>,
        camera: &ParallelCamera,
        memory: &[Binding<'_>],
        depth: &wgpu::TextureView,
    ) -> Result<(), RenderError> {
        let scene = work.scene;
        let variant = RasterVariant { appended: true, ..RasterVariant::of(work) };
        let camera_of_lines = std::iter::once(RasterCamera::of_lines(camera, work.scene_time_s));
        let groups = self.groups(scene, variant, camera_of_lines, Some(memory.to_vec()))?;
        let posed = scene.motion.as_ref().map(|motion| motion.at(work.scene_time_s));
        let posed = posed.as_ref().map(|posed| posed.buffers(&self.gpu));
        let frustum = Frustum::of_lines(camera);
        let size_px = camera.size_px;
        let view = View { scene, posed, place: 0, size_px, frustum, groups: groups.as_ref() };
        self.draw_in_slices(frame, &view, variant, &[], depth)
    }

    /// Draws a view in passes that each take about a slice: what is drawn stays in the targets.
    fn draw_in_slices(
        &self,
        frame: &mut Frame<'_>,
        view: &View<'_>,
        variant: RasterVariant,
        colors: &[&wgpu::TextureView],
        reversed_depth: &wgpu::TextureView,
    ) -> Result<(), RenderError> {
        let family = WorkKind::family(&("raster", view.scene.identity, view.size_px));
        let runs = visible_runs(view.scene, &view.frustum);
        let a_slice = self.gpu.device_queue.slice_units(family, UNKNOWN_SLICE_INDICES);
        for (number, runs) in slices(runs, a_slice).into_iter().enumerate() {
            self.announce(frame, view, variant, &runs)?;
            let clear = (number == 0).then_some(CLEAR);
            let mut pass = frame.begin_drawing("raster", colors, clear, reversed_depth);
            self.draw(&mut pass, view, variant, &runs)?;
            drop(pass);
            let indices = runs.iter().map(|run| run.indices.len() as u64).sum();
            frame.cut(WorkKind::new(family, &variant), indices);
        }
        Ok(())
    }

    /// Tells the frame of the pipelines that the next pass draws with.
    fn announce(
        &self,
        frame: &mut Frame<'_>,
        &View { scene, groups, .. }: &View<'_>,
        variant: RasterVariant,
        runs: &[Run],
    ) -> Result<(), RenderError> {
        let Some(groups) = groups else { return Ok(()) };
        let own = groups.own.as_ref().filter(|_| variant.has_own_group());
        for run in runs.chunk_by(|a, b| scene.draws[a.draw].state() == scene.draws[b.draw].state()) {
            let draw = &scene.draws[run[0].draw];
            let textures = &groups.textures[draw.texture as usize];
            let bound: Vec<_> = [&groups.scene, &groups.object, textures].into_iter().chain(own).collect();
            self.passes.get(&RasterVariant { material: draw.material, ..variant })?.announce(frame, &bound);
        }
        Ok(())
    }

    fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        &View { scene, posed, place, size_px, groups, .. }: &View<'_>,
        variant: RasterVariant,
        runs: &[Run],
    ) -> Result<(), RenderError> {
        let Some(groups) = groups else { return Ok(()) };
        // Layers of a set are as large as its largest image.
        let size = size_px.as_vec2();
        pass.set_viewport(0.0, 0.0, size.x, size.y, 0.0, 1.0);
        pass.set_index_buffer(scene.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.set_bind_group(0, &*groups.scene, &[place * CAMERA_STRIDE]);
        if let Some(own) = groups.own.as_ref().filter(|_| variant.has_own_group()) {
            pass.set_bind_group(OWN_GROUP, &**own, &[]);
        }
        let mut material = None;
        let mut texture = None;
        let mut object = None;
        let mut vertices = None;
        for run in runs {
            let draw = &scene.draws[run.draw];
            let buffers = posed.filter(|_| draw.posed).unwrap_or([&scene.vertices, &scene.details]);
            if vertices.replace(buffers) != Some(buffers) {
                (0..).zip(buffers).for_each(|(slot, buffer)| pass.set_vertex_buffer(slot, buffer.slice(..)));
            }
            if material.replace(draw.material) != Some(draw.material) {
                let variant = RasterVariant { material: draw.material, ..variant };
                pass.set_pipeline(self.passes.get(&variant)?.pipeline());
            }
            if object.replace(draw.object) != Some(draw.object) {
                pass.set_bind_group(1, &*groups.object, &[draw.object * OBJECT_STRIDE]);
            }
            if texture.replace(draw.texture) != Some(draw.texture) {
                pass.set_bind_group(2, &*groups.textures[draw.texture as usize], &[]);
            }
            let first_primitive = run.indices.start / 3;
            pass.draw_indexed(run.indices.clone(), draw.base_vertex, first_primitive..first_primitive + 1);
        }
        Ok(())
    }

    /// Groups that fit the variants of all materials; none for a scene without triangles.
    fn groups(
        &self,
        scene: &GpuScene,
        variant: RasterVariant,
        cameras: impl Iterator<Item = RasterCamera>,
        own: Option<Vec<Binding<'_>>>,
    ) -> Result<Option<Groups>, RenderError> {
        let Some(draw) = scene.draws.first() else { return Ok(None) };
        let pass = self.passes.get(&RasterVariant { material: draw.material, ..variant })?;
        let cameras = uniform(&self.gpu, "raster cameras", cameras);
        let common = [Binding::buffer("camera", &cameras), Binding::buffer("surroundings", &scene.surroundings)];
        let textures = scene.textures.iter().map(|textures| {
            let bindings = TEXTURES.iter().zip(textures).flat_map(|(names, (view, sampler))| {
                [Binding::texture(names.0, view), Binding::sampler(names.1, sampler)]
            });
            pass.bind(2, bindings)
        });
        Ok(Some(Groups {
            own: own.map(|bindings| pass.bind(OWN_GROUP, bindings)).transpose()?,
            scene: pass.bind(0, common)?,
            object: pass.bind(1, [Binding::buffer("object", &scene.objects)])?,
            textures: textures.collect::<Result<_, _>>()?,
        }))
    }
}

const CAMERA_STRIDE: u32 = uniform_stride(size_of::<RasterCamera>() as u32);
const OBJECT_STRIDE: u32 = uniform_stride(size_of::<GpuObject>() as u32);

impl RasterCamera {
    /// Depth is reversed: `near / planar depth`, 1 at the near plane and 0 at infinity.
    fn of(camera: &PinholeCamera, scene_time_s: f32) -> Self {
        let [u, v, w] = camera.homogeneous_pixel_from_world();
        let size = camera.size_px.as_vec2();
        let rows = [u * (2.0 / size.x) - w, w - v * (2.0 / size.y), Vec4::W * camera.near_m, w];
        Self {
            clip_from_world: columns_of(rows),
            eye_in_world: camera.eye_in_world.to_array(),
            scene_time_s,
            near_m: camera.near_m,
            footprint: camera.focal_px.min_element().recip(),
            padding: [0; 2],
        }
    }

    /// Depth is planar, 1 where the camera's range ends. A pixel's side is the same at all depths.
    fn of_lines(camera: &ParallelCamera, scene_time_s: f32) -> Self {
        let axes = camera.axes_in_world();
        let [right, down, forward] = axes.map(|axis| axis.extend(-axis.dot(camera.corner_in_world)));
        let size_m = camera.size_px.as_vec2() * camera.spacing_m;
        let [x, y] = [right * (2.0 / size_m.x) - Vec4::W, Vec4::W - down * (2.0 / size_m.y)];
        Self {
            clip_from_world: columns_of([x, y, forward / camera.range_m, Vec4::W]),
            eye_in_world: camera.corner_in_world.to_array(),
            scene_time_s,
            near_m: 0.0,
            footprint: camera.spacing_m,
            padding: [0; 2],
        }
    }
}

/// A camera of a batch, and what is drawn into its targets.
struct View<'r> {
    scene: &'r GpuScene,
    /// The vertices of instances that move, and their details.
    posed: Option<[&'r wgpu::Buffer; 2]>,
    /// Among the cameras that are drawn together.
    place: u32,
    size_px: UVec2,
    frustum: Frustum,
    groups: Option<&'r Groups>,
}

/// Neighbouring clusters drawn in one call, and the first of them.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Run {
    draw: usize,
    indices: Range<u32>,
}

fn visible_runs(scene: &GpuScene, frustum: &Frustum) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    let visible = scene.draws.iter().enumerate().filter(|(_, draw)| frustum.may_see(&draw.bounds_in_world));
    for (number, draw) in visible {
        let first = (draw.object, draw.indices.start);
        match runs.last_mut() {
            Some(run) if (scene.draws[run.draw].object, run.indices.end) == first => run.indices.end = draw.indices.end,
            _ => runs.push(Run { draw: number, indices: draw.indices.clone() }),
        }
    }
    runs
}

/// Runs in their order, cut where a slice has so many indices; one slice at least.
fn slices(runs: Vec<Run>, most_indices: u64) -> Vec<Vec<Run>> {
    let most = (most_indices / 3 * 3).clamp(3, u32::MAX.into()) as u32 / 3 * 3;
    let mut slices = vec![Vec::new()];
    let mut room = most;
    for Run { draw, indices } in runs {
        let mut first = indices.start;
        while first < indices.end {
            if room == 0 {
                slices.push(Vec::new());
                room = most;
            }
            let end = first.saturating_add(room).min(indices.end);
            room -= end - first;
            slices.last_mut().into_iter().for_each(|slice| slice.push(Run { draw, indices: first..end }));
            first = end;
        }
    }
    slices
}

/// The columns of a matrix with these rows.
fn columns_of(rows: [Vec4; 4]) -> [[f32; 4]; 4] {
    std::array::from_fn(|column| rows.map(|row| row[column]))
}

const VERTEX_ATTRIBUTES: [wgpu::VertexAttribute; 5] =
    wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2, 3 => Unorm8x4, 4 => Float32];
const DETAIL_ATTRIBUTES: [wgpu::VertexAttribute; 2] = wgpu::vertex_attr_array![5 => Float32x2, 6 => Float32x4];

/// A buffer of `V`, with these attributes.
fn layout<V>(attributes: &'static [wgpu::VertexAttribute]) -> wgpu::VertexBufferLayout<'static> {
    let step_mode = wgpu::VertexStepMode::Vertex;
    wgpu::VertexBufferLayout { array_stride: size_of::<V>() as u64, step_mode, attributes }
}

/// [`NOTHING`] in each channel.
const CLEAR: wgpu::Color = wgpu::Color { r: NOTHING as f64, g: NOTHING as f64, b: NOTHING as f64, a: NOTHING as f64 };

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_hold_all_triangles_in_their_order() {
        let runs =
            vec![Run { draw: 0, indices: 0..30 }, Run { draw: 4, indices: 60..63 }, Run { draw: 5, indices: 63..99 }];
        let primitives = |slices: &[Vec<Run>]| -> Vec<(usize, u32)> {
            slices.iter().flatten().flat_map(|run| run.indices.clone().map(|index| (run.draw, index))).collect()
        };
        assert_eq!(slices(runs.clone(), u64::MAX).concat(), runs);
        assert_eq!(slices(runs.clone(), u64::MAX).len(), 1);
        let cut = slices(runs.clone(), 13);
        assert_eq!(primitives(&cut), primitives(&[runs]));
        let sizes: Vec<usize> = cut.iter().map(|runs| runs.iter().map(|run| run.indices.len()).sum()).collect();
        assert_eq!(sizes, [12, 12, 12, 12, 12, 9]);
        assert_eq!(slices(Vec::new(), 3), [Vec::new()], "an empty view is cleared");
    }
}
