//! `bench sharing`: a viewer beside other clients of one cluster.

pub mod command;

mod beside;
mod guests;
mod report;
mod viewer;

#[cfg(test)]
mod tests;
