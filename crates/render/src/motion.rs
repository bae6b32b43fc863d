//! Instances that follow nodes and joints: their vertices in the world, posed on the host once a moment, for drawing and
//! for rays.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use gpu::Gpu;
use parking_lot::Mutex;
use scene::{Animation, Mesh, Scene, Vertex};
use wgpu::BufferUsages;

use crate::few_cores::on_free_cores;

/// The moving instances of a scene.
pub(crate) struct Motion {
    gpu: Arc<Gpu>,
    animation: Animation,
    /// Vertices at rest of the meshes that move, by the mesh's number.
    rest: BTreeMap<u32, Vec<Vertex>>,
    /// In the animation's order.
    meshes: Vec<u32>,
    /// The vertices of an instance among all posed ones.
    places: HashMap<u32, Range<usize>>,
    /// The last moment that was asked for.
    last: Mutex<Option<(f32, Arc<Posed>)>>,
}

/// The vertices of all moving instances at one moment, in the world.
pub(crate) struct Posed {
    pub vertices: Vec<Vertex>,
    /// The same on the device, once they are drawn.
    buffer: OnceLock<wgpu::Buffer>,
}

impl Motion {
    /// `None` for a scene without moving instances.
    pub fn of(gpu: &Arc<Gpu>, scene: &Scene) -> Option<Arc<Self>> {
        let animation = scene.animation.as_ref().filter(|animation| !animation.moving.is_empty())?.clone();
        let meshes: Vec<u32> = animation.moving.iter().map(|m| scene.instances[m.instance as usize].mesh).collect();
        let rest: BTreeMap<u32, Vec<Vertex>> =
            meshes.iter().map(|&mesh| (mesh, scene.meshes[mesh as usize].vertices.clone())).collect();
        let (mut places, mut first) = (HashMap::new(), 0);
        for (moving, mesh) in animation.moving.iter().zip(&meshes) {
            let end = first + rest[mesh].len();
            places.insert(moving.instance, first..end);
            first = end;
        }
        Some(Arc::new(Self { gpu: gpu.clone(), animation, rest, meshes, places, last: Mutex::default() }))
    }

    /// Vertices that [`Motion::of`] makes for a scene.
    pub fn vertex_count(scene: &Scene) -> usize {
        let moving = scene.animation.iter().flat_map(|animation| &animation.moving);
        let mesh = |instance: u32| &scene.meshes[scene.instances[instance as usize].mesh as usize];
        moving.map(|moving| mesh(moving.instance)).map(|mesh: &Mesh| mesh.vertices.len()).sum()
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
        let mut last = self.last.lock();
        match &*last {
            Some((time_s, posed)) if !self.moves() || *time_s == scene_time_s => posed.clone(),
            _ => {
                let vertices = on_free_cores(self.gpu.device_queue.cuts(), || self.vertices_at(scene_time_s));
                let posed = Arc::new(Posed { vertices, buffer: OnceLock::new() });
                *last = Some((scene_time_s, posed.clone()));
                posed
            }
        }
    }

    fn vertices_at(&self, scene_time_s: f32) -> Vec<Vertex> {
        let world_from_nodes = self.animation.world_from_nodes(scene_time_s);
        let moving = self.animation.moving.iter().zip(&self.meshes);
        moving.flat_map(|(moving, mesh)| self.animation.posed(moving, &self.rest[mesh], &world_from_nodes)).collect()
    }

    /// The bytes of the last pose on the device.
    pub fn bytes(&self) -> u64 {
        let last = self.last.try_lock();
        let buffer = |(_, posed): &(f32, Arc<Posed>)| posed.buffer.get().map(wgpu::Buffer::size);
        last.and_then(|last| last.as_ref().and_then(buffer)).unwrap_or(0)
    }
}

impl Posed {
    /// The vertices as a vertex buffer.
    pub fn buffer(&self, gpu: &Gpu) -> &wgpu::Buffer {
        self.buffer.get_or_init(|| gpu.buffer_with("posed vertices", &self.vertices, BufferUsages::VERTEX))
    }
}
