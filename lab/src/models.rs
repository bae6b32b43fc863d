//! Model files of a folder.

use std::path::{Path, PathBuf};

use app_core::exit::BadInput;

/// The largest model files of a folder and of its subfolders.
pub(crate) fn models_of(folder: &Path, most: usize) -> anyhow::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for path in entries(folder)? {
        let inside = if path.is_dir() { entries(&path)? } else { vec![path] };
        found.extend(inside.into_iter().filter(|path| is_model(path)));
    }
    anyhow::ensure!(!found.is_empty(), BadInput(format!("{}: no .gltf, .glb, .obj or .ply file", folder.display())));
    found.sort_by_key(|path| std::cmp::Reverse(std::fs::metadata(path).map_or(0, |file| file.len())));
    found.truncate(most);
    Ok(found)
}

/// The model file of a name, without its ending, in a folder or its subfolders.
pub(crate) fn model_named(folder: &Path, name: &str) -> anyhow::Result<PathBuf> {
    let mut models = models_of(folder, usize::MAX)?.into_iter();
    let model = models.find(|model| model.file_stem().is_some_and(|stem| stem == name));
    Ok(model.ok_or_else(|| BadInput(format!("{}: no model {name}", folder.display())))?)
}

fn entries(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let listed = std::fs::read_dir(folder)
        .and_then(|entries| entries.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>());
    let mut paths = listed.map_err(|error| BadInput(format!("{}: {error}", folder.display())))?;
    paths.sort();
    Ok(paths)
}

fn is_model(path: &Path) -> bool {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default().to_ascii_lowercase();
    ["gltf", "glb", "obj", "ply"].contains(&extension.as_str())
}
