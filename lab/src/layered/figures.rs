//! Pictures after the paper's figures, of views that the study makes anyway.

use anyhow::Context as _;
use depth_image::View;
use report::{Picture, PictureRow};

/// Views side by side, each with its caption: what a figure of the paper shows.
///
/// # Errors
/// A view whose colour is not of its size.
pub fn row<'v>(
    (figure, shows): (&str, &str),
    views: impl IntoIterator<Item = (String, &'v View)>,
) -> anyhow::Result<PictureRow> {
    let picture = |(caption, view): (String, &View)| {
        let image = pictures::rgb(view).context("a view of its size")?;
        Ok(Picture::new(format!("figure {figure}, {caption}"), caption, image))
    };
    let pictures = views.into_iter().map(picture).collect::<anyhow::Result<_>>()?;
    Ok(PictureRow { title: format!("{shows} (Fig. {figure})"), pictures })
}

/// The one of several views that pictures show.
///
/// # Errors
/// There is none.
pub fn middle(views: &[View]) -> anyhow::Result<&View> {
    views.get(views.len() / 2).context("a view")
}
