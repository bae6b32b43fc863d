//! The methods on the software device: against their scalar twins, closed forms and their own limits.

mod antialias;
mod background;
mod base;
mod batches;
mod blocks;
mod closed_form;
mod holes_and_limits;
mod layered;
mod light_field;
mod merging;
mod mesh_limits;
mod meshes;
mod mips;
mod mirrors;
mod non_redundant;
mod single_pole;
mod slices;
mod specular;
mod stage;
mod tone;
mod twins;
mod variants;
