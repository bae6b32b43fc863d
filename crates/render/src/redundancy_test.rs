//! Tests of whether samples are redundant with images before theirs.

/// A test of one candidate sample against one camera before the image's own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct RedundancyTest {
    /// The template of `fn is_redundant_with(candidate: Candidate, number: u32, camera: KnownCamera) -> bool`.
    pub shader: &'static str,
    /// The evidence that the test looks at.
    pub consults: Evidence,
    /// Whether all images have one camera, so that pixels are compared with the same pixel.
    pub from_one_place: bool,
}

/// The evidence of redundancy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Evidence {
    /// The scene, by rays.
    Scene,
    /// The triangle at each texel of the images before: instance and primitive, all bits set where there is none.
    SurfaceIds,
    /// The depth of each sample of the images before (`keep.wgsl`).
    Samples,
}

impl RedundancyTest {
    /// Whether the test traces rays; else it needs the images before.
    #[must_use]
    pub fn traces_rays(self) -> bool {
        self.consults == Evidence::Scene
    }
}
