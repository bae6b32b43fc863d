//! The forms that compute shaders are written out in, and the pipelines of those that have been asked for.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

use depth_image::{Highlight, SpecularPlanes};
use gpu::{Gpu, ShaderError, Templates, light_slots};
use minijinja::{Value, context};

use crate::{
    RenderError,
    binding::{Slot, group_layout},
    known::{KNOWN_SLOTS, LeaveOut},
    rays::Traced,
};

/// Pixels for which an adaptive rate traces rays in any case lie this far apart.
pub(crate) const GRID_PX: u32 = 4;

/// How surfaces are described, after what lights them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Shading {
    /// All in the plane that needs no light.
    #[default]
    Unlit,
    /// With a Blinn-Phong highlight.
    BlinnPhong,
    /// Metallic-roughness.
    Ggx,
}

impl Shading {
    pub(crate) fn of(highlight: Option<Highlight>) -> Self {
        match highlight {
            None => Self::Unlit,
            Some(Highlight::BlinnPhong) => Self::BlinnPhong,
            Some(Highlight::Ggx) => Self::Ggx,
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Unlit => "unlit",
            Self::BlinnPhong => "blinn_phong",
            Self::Ggx => "ggx",
        }
    }
}

/// How many rays a lamp and pixel a shader is written for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ShadowRays {
    /// Without shadows.
    #[default]
    None,
    /// To the middle.
    One,
    /// As many as the uniform says, spread over the lamp.
    Many,
}

/// Which pixels a pass lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Domain {
    /// All.
    #[default]
    All,
    /// Every so many in both directions.
    Grid,
    /// Those of a list.
    List,
}

/// The compute shaders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Pass {
    /// Surfaces by rays.
    Primary,
    /// Light of lamps and environment.
    #[default]
    Illuminate,
    /// Light between pixels that have it.
    Interpolate,
    /// What an image holds, for those after it.
    Keep,
    /// Surface and light to planes.
    Finish,
}

/// A compute shader and all that is written into it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Form {
    /// Which.
    pub pass: Pass,
    /// Whether surfaces were found by rays.
    pub by_rays: bool,
    /// See [`Shading`].
    pub shading: Shading,
    /// See [`ShadowRays`].
    pub shadow_rays: ShadowRays,
    /// Whether rays look for what occludes the environment.
    pub occluded: bool,
    /// Whether sums are added to.
    pub continued: bool,
    /// Whether highlights need to know what each light's rays met.
    pub visibility: bool,
    /// Lamps.
    pub light_count: usize,
    /// See [`Domain`].
    pub domain: Domain,
    /// Room for unvisited nodes.
    pub stack: u32,
    /// Whether textures decide where some triangles are.
    pub alpha_tested: bool,
    /// Whether nodes and triangles are counted.
    pub count_visits: bool,
    /// Distance of the pixels that are filled in.
    pub step_px: u32,
    /// Whether a highlight is added for the camera's own eye.
    pub highlight: bool,
    /// Whether depth images are made, not views.
    pub samples: bool,
    /// Planes of depth images.
    pub normal: bool,
    /// Planes of depth images.
    pub reflector: bool,
    /// Planes of depth images.
    pub surface_id: bool,
    /// What is not shown, because cameras before this one hold it.
    pub leave_out: Option<LeaveOut>,
    /// How many cameras those are.
    pub earlier: usize,
}

impl Form {
    /// Of a pass that traces rays against a scene. Room on the stack comes in steps, so that pipelines are shared.
    pub(crate) fn traced(traced: &Traced) -> Self {
        Self { stack: traced.depth.next_multiple_of(8), alpha_tested: traced.alpha_tested, ..Self::default() }
    }

    fn is_traced(&self) -> bool {
        self.pass == Pass::Primary || self.shadow_rays != ShadowRays::None || self.occluded
    }

    /// Words of packed visibility a pixel.
    pub(crate) fn visibility_words(&self) -> usize {
        if self.visibility { SpecularPlanes::visibility_planes(self.light_count) } else { 0 }
    }

    /// Planes of sums a pixel.
    pub(crate) fn sum_planes(&self) -> usize {
        6 + if self.visibility { self.light_count + 1 } else { 0 }
    }

    /// First plane of normals, reflectors, surface ids and of what rays passed among the finished planes, 0 where
    /// there is none; and the number of all planes.
    pub(crate) fn planes(&self) -> [usize; 5] {
        let normal = 2;
        let reflector = normal + usize::from(self.normal);
        let ids = reflector + if self.reflector { 1 + self.visibility_words() } else { 0 };
        let passed = ids + if self.surface_id { 2 } else { 0 };
        let end = passed + usize::from(self.leave_out.is_some());
        let present = |is: bool, plane: usize| if is { plane } else { 0 };
        [
            present(self.normal, normal),
            present(self.reflector, reflector),
            present(self.surface_id, ids),
            present(self.leave_out.is_some(), passed),
            end,
        ]
    }

    fn template(&self) -> &'static str {
        match self.pass {
            Pass::Primary => "rays/primary.wgsl",
            Pass::Illuminate => "illuminate.wgsl",
            Pass::Interpolate => "interpolate.wgsl",
            Pass::Keep => "keep.wgsl",
            Pass::Finish => "finish.wgsl",
        }
    }

    fn context(&self) -> Value {
        let [normal_plane, reflector_plane, id_plane, passed_plane, _] = self.planes();
        let highlight = if self.highlight { Value::from(self.shading.name()) } else { Value::from(false) };
        context! {
            primary => self.pass == Pass::Primary,
            by_rays => self.by_rays,
            shading => self.shading.name(),
            lit => self.shading != Shading::Unlit,
            shadow_rays => match self.shadow_rays {
                ShadowRays::None => "none",
                ShadowRays::One => "one",
                ShadowRays::Many => "many",
            },
            occluded => self.occluded,
            traced => self.is_traced(),
            continued => self.continued,
            visibility => self.visibility,
            visibility_words => self.visibility_words(),
            sum_planes => self.sum_planes(),
            light_count => self.light_count,
            light_slots => light_slots(self.light_count),
            domain => match self.domain { Domain::All => "all", Domain::Grid => "grid", Domain::List => "list" },
            grid_px => GRID_PX,
            step_px => self.step_px,
            stack => self.stack.max(1),
            alpha_tested => self.alpha_tested,
            count_visits => self.count_visits,
            highlight,
            samples => self.samples,
            normal_plane, reflector_plane, id_plane, passed_plane,
            leave_out => self.leave_out.map(|test| test.shader),
            test_traces_rays => self.leave_out.is_some_and(|test| test.traces_rays()),
            settled => self.leave_out.is_some_and(|test| test.settled),
            earlier => self.earlier,
            only_useful => self.leave_out.is_some_and(|test| test.only_useful),
            known_group => 2,
            nothing => u32::MAX,
            surface_id => self.surface_id,
            bias_footprints => format!("{:?}", crate::BIAS_FOOTPRINTS),
        }
    }

    fn slots(&self) -> Vec<Slot> {
        let depth = if self.by_rays { Slot::FloatTexture } else { Slot::DepthTexture };
        let mut slots = vec![Slot::DynamicUniform];
        slots.extend(match self.pass {
            Pass::Primary => vec![
                Slot::WrittenTexture(wgpu::TextureFormat::Rgba32Uint),
                Slot::WrittenTexture(wgpu::TextureFormat::R32Float),
            ],
            Pass::Illuminate => vec![Slot::Uniform, Slot::WordTexture, depth, Slot::Written],
            Pass::Interpolate => vec![Slot::WordTexture, depth, Slot::Written, Slot::Written, Slot::Written],
            Pass::Keep => {
                vec![Slot::WordTexture, depth, Slot::WrittenTexture(wgpu::TextureFormat::Rgba32Uint)]
            }
            Pass::Finish => vec![Slot::WordTexture, depth, Slot::Written, Slot::Read, Slot::Uniform, Slot::Uniform],
        });
        if self.pass == Pass::Illuminate && self.domain == Domain::List {
            slots.extend([Slot::Read, Slot::Read]);
        }
        if self.surface_id {
            slots.push(match self.pass {
                Pass::Primary => Slot::WrittenTexture(wgpu::TextureFormat::Rg32Uint),
                _ => Slot::WordTexture,
            });
        }
        if self.leave_out.is_some() {
            slots.push(match self.pass {
                Pass::Primary => Slot::WrittenTexture(wgpu::TextureFormat::R32Float),
                _ => depth,
            });
        }
        if self.count_visits {
            slots.push(Slot::Written);
        }
        slots
    }
}

/// The WGSL of a form.
///
/// # Errors
/// When a template is broken.
pub fn shader_text(templates: &Templates, form: Form) -> Result<String, ShaderError> {
    templates.render(form.template(), form.context())
}

/// Pipelines that have been asked for.
pub(crate) struct ComputePipelines {
    gpu: Arc<Gpu>,
    templates: Arc<Templates>,
    built: Mutex<HashMap<Form, Arc<wgpu::ComputePipeline>>>,
}

impl ComputePipelines {
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self { gpu: gpu.clone(), templates: templates.clone(), built: Mutex::default() }
    }

    /// Builds what was not asked for before.
    pub fn get(&self, form: Form) -> Result<Arc<wgpu::ComputePipeline>, RenderError> {
        let mut built = self.built.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = built.get(&form) {
            return Ok(pipeline.clone());
        }
        let pipeline = Arc::new(self.build(form)?);
        built.insert(form, pipeline.clone());
        Ok(pipeline)
    }

    fn build(&self, form: Form) -> Result<wgpu::ComputePipeline, RenderError> {
        let label = form.template();
        let module = self.gpu.shader(label, &shader_text(&self.templates, form)?);
        let own = group_layout(&self.gpu, label, &form.slots());
        let rays = group_layout(&self.gpu, "triangles", &RAY_SLOTS);
        let known = group_layout(&self.gpu, "known samples", &KNOWN_SLOTS);
        let groups = [Some(&own), Some(&rays), Some(&known)];
        let leaves_out = form.pass == Pass::Primary && form.leave_out.is_some();
        let layout = self.gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: &groups[..1 + usize::from(form.is_traced()) + usize::from(leaves_out)],
            immediate_size: 0,
        });
        Ok(self.gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(label),
            layout: Some(&layout),
            module: &module,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            cache: None,
        }))
    }
}

/// Group 1 of shaders that trace rays.
const RAY_SLOTS: [Slot; 6] = [Slot::WordTexture; 6];
