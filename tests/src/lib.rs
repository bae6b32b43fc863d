//! Whole-project tests: architecture and clusters on real processes and ports.
