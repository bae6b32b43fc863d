//! `myriorama-lab study layered`: views from layered depth cubes.

mod accuracy;
mod baked;
mod base;
mod baselines;
pub mod command;
mod cubes;
mod figures;
mod glossy;
mod light_fields;
mod mirrors;
mod paper;
pub mod pyramid;
mod storage;
pub mod subject;
mod table_one;
mod triangles;
mod viewpoints;
pub mod views;
mod warp;
