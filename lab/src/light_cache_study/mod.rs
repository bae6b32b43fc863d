//! `myriorama-lab study light_cache`: views whose light comes from samples, against direct drawing at equal error.

pub mod command;
mod conditions;
mod measure;
mod report;
mod stage;
mod subjects;
