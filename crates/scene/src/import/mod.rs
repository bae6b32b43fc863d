//! Import of scene files. Each format fills a [`source_scene::SourceScene`] in double precision. Its `finish` does the
//! common steps: re-centring, mirrored placements, limits, validation.

mod environment;
mod file_search;
mod folder;
mod gltf;
mod ktx2;
mod normals;
mod obj;
mod options;
mod picture;
mod ply;
mod polygons;
mod source_scene;
mod vertex_colors;
mod warnings;

use std::path::Path;

use crate::error::Fault;
use crate::{Limits, Scene, SceneError};
pub use environment::load_environment;
use folder::{Folder, decoded};
use options::Import;
pub use options::{ImportOptions, MissingTextures, MissingTexturesError};
use source_scene::{PlacedCamera, SourceInstance, SourceMesh, SourceScene, plain_vertex};
use warnings::Warnings;

/// Reads a scene from a `.gltf`, `.glb`, `.obj` or `.ply` file. Files that it refers to are read only
/// from its own folder and below. The scene has the lights that the file lists, which may be none: see
/// [`Scene::with_default_lights`]. Its background is the default one.
///
/// Axes are kept as in the file (only glTF defines them). Coordinates are kept too, unless `f32` would lose
/// detail far from the origin. That is the case when the centre of the bounds is more than 10 km, or more than 1000
/// times the bounds' diagonal, from the origin. Then all parts, lights and cameras included, are moved. A scene of less than
/// 10⁻³ or more than 10⁶ units is scaled to about a metre. [`Scene::source_space`] leads back to the file's coordinates.
///
/// # Errors
/// The file, the element at fault, and the reason.
pub fn load_file(path: &Path, limits: &Limits, options: impl Into<ImportOptions>) -> Result<Scene, SceneError> {
    let _importing = tracing::warn_span!("import", file = %path.display()).entered();
    let scene = read_source(path, limits, &options.into()).and_then(|source| source.finish(limits));
    scene.map_err(|fault| fault.in_file(path.display().to_string()))
}

fn read_source(path: &Path, limits: &Limits, options: &ImportOptions) -> Result<SourceScene, Fault> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let read: fn(&[u8], &Import) -> Result<SourceScene, Fault> = match extension.as_str() {
        "gltf" | "glb" => gltf::read,
        "obj" => obj::read,
        "ply" => ply::read,
        _ => {
            let known = format!("extension {extension:?}; known are gltf, glb, obj and ply");
            return Err(Fault::unsupported("file name", known));
        }
    };
    let (folder, bytes) = Folder::open(path, limits)?;
    let import = Import { folder, limits, options, warnings: Warnings::default() };
    let source = read(&bytes, &import);
    import.warnings.log();
    let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(SourceScene { name, ..source? })
}
