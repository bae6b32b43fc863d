//! Sampling methods (scene to depth images) and sample-camera rigs.
