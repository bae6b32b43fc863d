//! Pictures of the views.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use app_core::camera_file::NamedCamera;
use app_core::{pictures, provenance};
use client::Frame;
use serde_json::{Map, json};

/// Writes the planes of a frame, each as a picture, and returns its camera with their names.
pub(super) fn write(folder: &Path, frame: &Frame) -> anyhow::Result<NamedCamera> {
    let stem = format!("view_{:04}", frame.request.frame);
    let file_path = format!("{stem}.png");
    let save = |path: PathBuf, image: image::DynamicImage| {
        image.save(&path).with_context(|| format!("cannot write {}", path.display()))
    };
    let color = pictures::rgb(&frame.view).context("a view is not of its size")?;
    save(folder.join(&file_path), color.into())?;
    let mut more = Map::from_iter([("set_index".to_owned(), json!(frame.request.set_index))]);
    if let Some((image, greatest)) = pictures::inverse_depth_16(&frame.view) {
        let name = format!("{stem}.depth.png");
        save(folder.join(&name), image.into())?;
        more.insert("depth_file_path".to_owned(), json!(name));
        more.insert("inverse_depth_max_per_m".to_owned(), json!(greatest));
    }
    if let Some(provenance) = provenance::false_color(&frame.view) {
        let name = format!("{stem}.provenance.png");
        save(folder.join(&name), provenance.image.into())?;
        more.insert("provenance_file_path".to_owned(), json!(name));
    }
    Ok(NamedCamera { file_path, camera: frame.request.camera, more })
}
