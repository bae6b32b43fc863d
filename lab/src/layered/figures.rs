//! Pictures after the paper's figures.

use anyhow::Context as _;
use depth_image::View;
use report::{Picture, PictureRow};

/// Views side by side, each with its caption.
///
/// # Errors
/// A view whose colour is not of its size.
pub fn row<'v>(
    figure: u32,
    title: &str,
    views: impl IntoIterator<Item = (String, &'v View)>,
) -> anyhow::Result<PictureRow> {
    let mut pictures = Vec::new();
    for (caption, view) in views {
        let image = pictures::rgb(view).context("a view of its size")?;
        pictures.push(Picture::new(format!("figure {figure}, {caption}"), caption, image));
    }
    Ok(PictureRow { title: format!("{title} (Fig. {figure})"), pictures })
}
