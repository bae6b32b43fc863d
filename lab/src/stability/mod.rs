//! `myriorama-lab study stability`: errors from frame to frame along paths, and the jump where a view's samples change.

pub mod command;
mod figures;
mod measure;
mod paths;
mod report;
mod still;
mod subject;
#[cfg(test)]
mod tests;
