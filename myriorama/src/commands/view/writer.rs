//! Pictures of views, written while the next views come.

use std::path::{Path, PathBuf};
use std::thread::available_parallelism;

use anyhow::Context as _;
use app_core::camera_file::NamedCamera;
use app_core::pictures;
use client::Frame;
use image::{DynamicImage, ImageFormat};
use serde_json::{Map, json};
use tokio::task::JoinSet;

/// Most bytes of frames that are written at once, though always one frame.
const BYTES_AT_ONCE: usize = 128 << 20;

/// Writes frames into a folder, a few at once.
pub(super) struct PictureWriter {
    folder: PathBuf,
    most_at_once: usize,
    writing: JoinSet<anyhow::Result<(u64, NamedCamera)>>,
    written: Vec<(u64, NamedCamera)>,
}

impl PictureWriter {
    /// `frame_bytes` are those of the largest frame.
    pub(super) fn new(folder: &Path, frame_bytes: usize) -> Self {
        let processors = available_parallelism().map_or(1, usize::from);
        let most_at_once = (BYTES_AT_ONCE / frame_bytes.max(1)).clamp(1, processors);
        Self { folder: folder.to_owned(), most_at_once, writing: JoinSet::new(), written: Vec::new() }
    }

    /// Begins to write a frame once there is room.
    ///
    /// # Errors
    /// An earlier frame cannot be written.
    pub(super) async fn write(&mut self, frame: Frame) -> anyhow::Result<()> {
        if self.writing.len() >= self.most_at_once {
            self.wait_for_one().await?;
        }
        let folder = self.folder.clone();
        self.writing.spawn_blocking(move || Ok((frame.request.frame, write_frame(&folder, &frame)?)));
        Ok(())
    }

    /// The cameras of all frames, by number, once all are written.
    ///
    /// # Errors
    /// A frame cannot be written.
    pub(super) async fn finish(mut self) -> anyhow::Result<Vec<NamedCamera>> {
        while !self.writing.is_empty() {
            self.wait_for_one().await?;
        }
        self.written.sort_by_key(|(number, _)| *number);
        Ok(self.written.into_iter().map(|(_, camera)| camera).collect())
    }

    async fn wait_for_one(&mut self) -> anyhow::Result<()> {
        if let Some(written) = self.writing.join_next().await {
            self.written.push(written??);
        }
        Ok(())
    }
}

/// The name of a view's picture.
pub(super) fn file_name(number: u64) -> String {
    format!("view_{number:04}.png")
}

/// Writes the planes of a frame, each as a picture, and returns its camera with their names.
fn write_frame(folder: &Path, frame: &Frame) -> anyhow::Result<NamedCamera> {
    let stem = format!("view_{:04}", frame.request.frame);
    let file_path = file_name(frame.request.frame);
    let color = pictures::rgb(&frame.view).context("a view is not of its size")?;
    save(&folder.join(&file_path), color.into())?;
    let mut more = Map::from_iter([("set_index".to_owned(), json!(frame.request.set_index))]);
    if let Some((image, greatest)) = pictures::inverse_depth_16(&frame.view) {
        let name = format!("{stem}.depth.png");
        save(&folder.join(&name), image.into())?;
        more.insert("depth_file_path".to_owned(), json!(name));
        more.insert("inverse_depth_max_per_m".to_owned(), json!(greatest));
    }
    if let Some((image, _)) = pictures::provenance(&frame.view) {
        let name = format!("{stem}.provenance.png");
        save(&folder.join(&name), image.into())?;
        more.insert("provenance_file_path".to_owned(), json!(name));
    }
    Ok(NamedCamera { file_path, camera: frame.request.camera, more })
}

/// A picture is whole under its name, or not there.
fn save(path: &Path, image: DynamicImage) -> anyhow::Result<()> {
    let part = path.with_extension("part");
    let saved = image.save_with_format(&part, ImageFormat::Png).map_err(anyhow::Error::from);
    let saved = saved.and_then(|()| Ok(std::fs::rename(&part, path)?));
    saved.with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use codec::{FrameCodec, FrameHeader, SampleSetId, StageTimes};
    use depth_image::{PinholeCamera, View};
    use glam::{UVec2, Vec3};

    use super::*;

    fn frame(number: u64) -> Frame {
        let size_px = UVec2::new(3, 2);
        let camera = PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, size_px);
        let header = FrameHeader {
            sample_set_id: SampleSetId { plan_epoch: 1, index: 0 },
            cell: 0,
            is_neighbour_cell: false,
            camera,
            size_px,
            codec: FrameCodec::Lz4,
            color_bytes: 18,
            inverse_depth_bytes: 0,
            provenance_bytes: 0,
            crc32: 0,
            stage_times: StageTimes::default(),
        };
        let view =
            View { size_px, srgb8: vec![number as u8; 18], inverse_depth_per_m: Some(vec![0.5; 6]), provenance: None };
        Frame { request: client::ViewRequest { frame: number, set_index: 0, camera }, view, header }
    }

    #[tokio::test]
    async fn frames_of_any_order_are_whole_files_and_cameras_by_number() {
        let folder = tempfile::tempdir().unwrap();
        let mut writer = PictureWriter::new(folder.path(), 1 << 30);
        assert_eq!(writer.most_at_once, 1, "a frame is larger than the bound");
        for number in [2, 0, 1] {
            writer.write(frame(number)).await.unwrap();
            assert_eq!(writer.writing.len(), 1);
        }
        let names: Vec<_> = writer.finish().await.unwrap().into_iter().map(|camera| camera.file_path).collect();
        assert_eq!(names, ["view_0000.png", "view_0001.png", "view_0002.png"]);
        assert_eq!(image::open(folder.path().join(&names[2])).unwrap().into_rgb8().into_raw(), [2; 18]);
        let files = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
        assert!(files.into_iter().all(|name| name.to_string_lossy().ends_with(".png")), "no part is left");
    }

    #[tokio::test]
    async fn a_folder_that_is_gone_is_named() {
        let mut writer = PictureWriter::new(Path::new("/nowhere/out"), 1);
        writer.write(frame(7)).await.unwrap();
        let error = format!("{:#}", writer.finish().await.unwrap_err());
        assert!(error.contains("/nowhere/out/view_0007.png"), "{error}");
    }
}
