//! Pictures of views, written while the next views come.

use std::path::{Path, PathBuf};
use std::thread::available_parallelism;

use anyhow::Context as _;
use client::Frame;
use depth_image::ViewPlanes;
use image::{DynamicImage, ImageFormat};
use tokio::task::JoinSet;

use super::file_names::FileNames;

/// Most bytes of frames that are written at once, with their copies, though always one frame.
const BYTES_AT_ONCE: usize = 128 << 20;
/// Bytes a pixel that writing takes beside the frame: a copy of its colour, and the compressed picture.
const COPY_BYTES_PER_PIXEL: usize = 6;

/// A written view, and the scale of its depth picture, as in the record.
pub(super) type Written = (u64, f32);

/// Writes frames into a folder, a few at once.
///
/// A client holds [96 MiB of frames](client::Frames) until they are taken, and a frame that is taken is written at once. All
/// frames together have 224 MiB at most, or are two larger ones.
pub(super) struct PictureWriter {
    folder: PathBuf,
    most_at_once: usize,
    writing: JoinSet<anyhow::Result<Written>>,
}

impl PictureWriter {
    /// `pixels` are those of the largest frame.
    pub(super) fn new(folder: &Path, pixels: usize, planes: ViewPlanes) -> Self {
        let processors = available_parallelism().map_or(1, usize::from);
        let frame_bytes = pixels * (planes.bytes_per_pixel() + COPY_BYTES_PER_PIXEL);
        let most_at_once = (BYTES_AT_ONCE / frame_bytes.max(1)).clamp(1, processors);
        Self { folder: folder.to_owned(), most_at_once, writing: JoinSet::new() }
    }

    /// Begins to write a frame, and waits until there is room for another. Gives a view that was written meanwhile. Once
    /// this has begun, the frame is written, also where the caller does not wait.
    ///
    /// # Errors
    /// An earlier frame cannot be written.
    pub(super) async fn write(&mut self, frame: Frame) -> anyhow::Result<Option<Written>> {
        let folder = self.folder.clone();
        self.writing.spawn_blocking(move || write_frame(&folder, &frame));
        if self.writing.len() < self.most_at_once { Ok(None) } else { self.next_written().await }
    }

    /// The next view that is written; `None` when all are.
    ///
    /// # Errors
    /// A frame cannot be written.
    pub(super) async fn next_written(&mut self) -> anyhow::Result<Option<Written>> {
        self.writing.join_next().await.transpose()?.transpose()
    }
}

/// Writes the planes of a frame, each as a picture.
fn write_frame(folder: &Path, frame: &Frame) -> anyhow::Result<Written> {
    let number = frame.request.frame;
    let view = &frame.view;
    let planes = ViewPlanes {
        inverse_depth: view.inverse_depth_per_m.is_some(),
        provenance: view.provenance.is_some(),
        ..ViewPlanes::default()
    };
    let names = FileNames::of(number, planes);
    let color = pictures::rgb(view).context("a view is not of its size")?;
    save(&folder.join(names.color), color.into())?;
    let mut depth_scale = 0.0;
    if let (Some((image, greatest)), Some(name)) = (pictures::inverse_depth_16(view), names.depth) {
        save(&folder.join(name), image.into())?;
        depth_scale = greatest;
    }
    if let (Some((image, _)), Some(name)) = (pictures::provenance(view, 0), names.provenance) {
        save(&folder.join(name), image.into())?;
    }
    Ok((number, depth_scale))
}

/// A picture is whole under its name, or not there.
fn save(path: &Path, image: DynamicImage) -> anyhow::Result<()> {
    let part = path.with_extension("part");
    let saved = image.save_with_format(&part, ImageFormat::Png).map_err(anyhow::Error::from);
    let saved = saved.and_then(|()| Ok(std::fs::rename(&part, path)?));
    if saved.is_err() {
        // There may be none, and the first error counts.
        let _ = std::fs::remove_file(&part);
    }
    saved.with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use codec::{FrameCodec, FrameHeader, SampleSetId, StageTimes};
    use depth_image::{Antialias, PinholeCamera, ToneMapping, View};
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
            antialias: Antialias::NONE,
            tone: ToneMapping::NONE,
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
    async fn frames_of_any_order_are_whole_files() {
        let folder = tempfile::tempdir().unwrap();
        let mut writer = PictureWriter::new(folder.path(), 1 << 30, ViewPlanes::WITH_DEPTH);
        assert_eq!(writer.most_at_once, 1, "a frame is larger than the bound");
        for number in [2, 0, 1] {
            assert_eq!(writer.write(frame(number)).await.unwrap(), Some((number, 0.5)));
        }
        assert_eq!(writer.next_written().await.unwrap(), None);
        let picture = folder.path().join("view_0002.png");
        assert_eq!(image::open(picture).unwrap().into_rgb8().into_raw(), [2; 18]);
        let files = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
        let names: Vec<_> = files.map(|name| name.into_string().unwrap()).collect();
        assert!(names.len() == 6 && names.iter().all(|name| name.ends_with(".png")), "no part is left: {names:?}");
    }

    #[tokio::test]
    async fn frames_in_hand_stay_within_the_bound() {
        let folder = tempfile::tempdir().unwrap();
        let mut writer = PictureWriter::new(folder.path(), 1, ViewPlanes::WITH_DEPTH);
        writer.most_at_once = 2;
        assert_eq!(writer.write(frame(0)).await.unwrap(), None);
        for number in 1..5 {
            assert!(writer.write(frame(number)).await.unwrap().is_some());
            assert_eq!(writer.writing.len(), 1, "there is room for the next frame");
        }
    }

    #[tokio::test]
    async fn a_folder_that_is_gone_is_named() {
        let mut writer = PictureWriter::new(Path::new("/nowhere/out"), 1, ViewPlanes::WITH_DEPTH);
        writer.most_at_once = 1;
        let error = format!("{:#}", writer.write(frame(7)).await.unwrap_err());
        assert!(error.contains("/nowhere/out/view_0007.png"), "{error}");
    }
}
