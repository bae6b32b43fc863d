//! The names of a view's pictures.

use std::path::Path;

use depth_image::ViewPlanes;

/// The pictures of one view; the depth and the provenance where they were requested.
pub(super) struct FileNames {
    pub(super) color: String,
    pub(super) depth: Option<String>,
    pub(super) provenance: Option<String>,
}

impl FileNames {
    pub(super) fn of(number: u64, planes: ViewPlanes) -> Self {
        Self {
            color: format!("view_{number:04}.png"),
            depth: planes.inverse_depth.then(|| format!("view_{number:04}.depth.png")),
            provenance: planes.provenance.then(|| format!("view_{number:04}.provenance.png")),
        }
    }

    /// All names.
    pub(super) fn all(&self) -> impl Iterator<Item = &String> {
        [&self.color].into_iter().chain(&self.depth).chain(&self.provenance)
    }
}

/// The number of the view that has this colour picture.
pub(super) fn number_of(color: &str) -> Option<u64> {
    color.strip_prefix("view_")?.strip_suffix(".png")?.parse().ok()
}

/// Removes what an earlier process left unfinished.
pub(super) fn remove_parts(folder: &Path) {
    for entry in folder.read_dir().into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.ends_with(".part") && (name.starts_with("view_") || name == "cameras.part") {
            // A part that stays does no harm: it has no picture's name.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}
