//! A scene in a line of text.

use crate::Scene;

impl Scene {
    /// The number of triangles, and the clips with their durations, as in "12 triangles; clips: walk (1.5 s, plays), run
    /// (0.8 s)".
    #[must_use]
    pub fn contents(&self) -> String {
        let triangles = format!("{} triangles", self.triangle_count());
        let Some(animation) = self.animation.as_ref().filter(|animation| !animation.clips.is_empty()) else {
            return triangles;
        };
        let clips = (0..).zip(&animation.clips).map(|(number, clip)| {
            let plays = if animation.playing == Some(number) { ", plays" } else { "" };
            format!("{} ({} s{plays})", clip.name, clip.duration_s())
        });
        format!("{triangles}; clips: {}", clips.collect::<Vec<_>>().join(", "))
    }
}
