//! Myriorama: the one program.
fn main() {}
