//! `myriorama-lab study layered`: the measurements of Lischinski and Rappoport, by layered depth cubes and light fields.

mod baselines;
pub mod command;
mod figures;
mod glossy;
mod light_fields;
mod mirrors;
mod paper;
pub mod pyramid;
mod storage;
pub mod subject;
mod table_one;
pub mod views;
mod warp;
