//! Scenes through the public interface: imports, damaged files, lights, procedural scenes and packages.
#![allow(clippy::unwrap_used)]

mod animation;
mod damaged_files;
mod gltf_compression;
mod gltf_draco;
mod gltf_extensions;
mod gltf_import;
mod gltf_json;
mod gltf_materials;
mod gltf_skins;
mod gltf_textures;
mod ktx2_textures;
mod lighting;
mod mtl_materials;
mod obj_and_ply_import;
mod obj_files_and_text;
mod packages;
mod ply_contents;
mod samples;
mod scale;
