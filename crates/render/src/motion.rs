//! Instances that follow nodes and joints: their vertices in the world, posed on the host once a moment, for drawing and
//! for rays.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use gpu::Gpu;
use parking_lot::Mutex;
use scene::{Animation, Material, Mesh, Scene, Vertex, VertexDetail};
use wgpu::BufferUsages;

use crate::few_cores::on_free_cores;

/// The moving instances of a scene.
pub(crate) struct Motion {
    gpu: Arc<Gpu>,
    animation: Animation,
    /// Meshes that move, at rest, by their number.
    rest: BTreeMap<u32, Rest>,
    /// In the animation's order.
    meshes: Vec<u32>,
    /// The vertices of an instance among all posed ones.
    places: HashMap<u32, Range<usize>>,
    /// The last moment that was asked for.
    last: Mutex<Option<(f32, Arc<Posed>)>>,
}

/// The vertices of a mesh at rest. Details are one for each, or none where no material of the scene needs them.
struct Rest {
    vertices: Vec<Vertex>,
    details: Vec<VertexDetail>,
}

/// The vertices of all moving instances at one moment, in the world.
pub(crate) struct Posed {
    pub vertices: Vec<Vertex>,
    /// One for each vertex, or none.
    pub details: Vec<VertexDetail>,
    /// The same on the device, once they are drawn.
    buffers: OnceLock<[wgpu::Buffer; 2]>,
}

impl Motion {
    /// `None` for a scene without moving instances.
    pub fn of(gpu: &Arc<Gpu>, scene: &Scene) -> Option<Arc<Self>> {
        let animation = scene.animation.as_ref().filter(|animation| !animation.moving.is_empty())?.clone();
        let meshes: Vec<u32> = animation.moving.iter().map(|m| scene.instances[m.instance as usize].mesh).collect();
        let is_mapped = scene.materials.iter().any(Material::is_mapped);
        let rest = meshes.iter().map(|&number| {
            let Mesh { vertices, details, .. } = &scene.meshes[number as usize];
            let mut details = if is_mapped { details.clone() } else { Vec::new() };
            details.resize(if is_mapped { vertices.len() } else { 0 }, VertexDetail::default());
            (number, Rest { vertices: vertices.clone(), details })
        });
        let rest: BTreeMap<u32, Rest> = rest.collect();
        let mut places = HashMap::new();
        let mut first = 0;
        for (moving, mesh) in animation.moving.iter().zip(&meshes) {
            let end = first + rest[mesh].vertices.len();
            places.insert(moving.instance, first..end);
            first = end;
        }
        Some(Arc::new(Self { gpu: gpu.clone(), animation, rest, meshes, places, last: Mutex::default() }))
    }

    /// Vertices that [`Motion::of`] makes for a scene.
    pub fn vertex_count(scene: &Scene) -> usize {
        let moving = scene.animation.iter().flat_map(|animation| &animation.moving);
        let meshes = moving.map(|moving| scene.instances[moving.instance as usize].mesh);
        meshes.map(|mesh| scene.meshes[mesh as usize].vertices.len()).sum()
    }

    /// Whether poses depend on scene time.
    pub fn moves(&self) -> bool {
        self.animation.period_s().is_some()
    }

    /// The vertices of an instance among [`Posed::vertices`]; `None` for one that stays.
    pub fn place(&self, instance: u32) -> Option<Range<usize>> {
        self.places.get(&instance).cloned()
    }

    /// The pose of a moment.
    pub fn at(&self, scene_time_s: f32) -> Arc<Posed> {
        if let Some((time_s, posed)) = &*self.last.lock()
            && (!self.moves() || *time_s == scene_time_s)
        {
            return posed.clone();
        }
        // Not under the lock: the pool's threads may ask for a pose, too.
        let posed = Arc::new(on_free_cores(self.gpu.device_queue.cuts(), || self.posed(scene_time_s)));
        *self.last.lock() = Some((scene_time_s, posed.clone()));
        posed
    }

    fn posed(&self, scene_time_s: f32) -> Posed {
        let world_from_nodes = self.animation.world_from_nodes(scene_time_s);
        let mut vertices = Vec::new();
        let mut details = Vec::new();
        for (moving, mesh) in self.animation.moving.iter().zip(&self.meshes) {
            let rest = &self.rest[mesh];
            vertices.extend(moving.posed(&rest.vertices, &world_from_nodes));
            details.extend(moving.posed_details(&rest.details, &world_from_nodes));
        }
        Posed { vertices, details, buffers: OnceLock::new() }
    }

    /// The bytes of the last pose on the device.
    pub fn bytes(&self) -> u64 {
        let Some(last) = self.last.try_lock() else { return 0 };
        let buffers = last.as_ref().and_then(|(_, posed)| posed.buffers.get());
        buffers.into_iter().flatten().map(wgpu::Buffer::size).sum()
    }
}

impl Posed {
    /// The vertices and their details as vertex buffers.
    pub fn buffers(&self, gpu: &Gpu) -> [&wgpu::Buffer; 2] {
        let buffers = self.buffers.get_or_init(|| {
            let vertices = gpu.buffer_with("posed vertices", &self.vertices, BufferUsages::VERTEX);
            [vertices, gpu.buffer_with("posed vertex details", &self.details, BufferUsages::VERTEX)]
        });
        buffers.each_ref()
    }
}
