//! `myriorama study layered`: views from layered depth cubes.

pub mod command;
mod cubes;
mod subject;
mod views;
