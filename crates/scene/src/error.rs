//! Errors of scenes: the file, the element and the reason.

use std::fmt;

use depth_image::LightError;

/// An unusable scene. Display reads `file: element: reason`.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {element}: {kind}")]
pub struct SceneError {
    /// The file, the package or the scene's name.
    pub file: String,
    /// The part at fault: an accessor, a line, a header.
    pub element: String,
    /// The reason; Display includes it, so it is no source.
    pub kind: SceneErrorKind,
}

/// The reason for which a scene is refused.
#[derive(Debug, thiserror::Error)]
pub enum SceneErrorKind {
    /// The operating system refused.
    #[error("cannot be read or written: {0}")]
    Io(#[from] std::io::Error),
    /// The bytes violate the format.
    #[error("{0}")]
    Malformed(String),
    /// The file is well-formed and uses a feature that this program lacks.
    #[error("not supported: {0}")]
    Unsupported(String),
    /// The file refers to something outside the scene's folder.
    #[error("refers to {reference:?}, which {reason}")]
    #[allow(missing_docs, reason = "self-naming fields")]
    Forbidden { reference: String, reason: &'static str },
    /// The file refers to others that are not there.
    #[error("missing: {}", .0.join(", "))]
    MissingFiles(Vec<String>),
    /// A number exceeds [`crate::Limits`].
    #[error("{actual} is over the limit of {limit}")]
    #[allow(missing_docs, reason = "self-naming fields")]
    TooLarge { actual: u64, limit: u64 },
}

/// A [`SceneError`] before the file's name is known.
#[derive(Debug)]
pub(crate) struct Fault {
    element: String,
    pub(crate) kind: SceneErrorKind,
}

impl Fault {
    pub(crate) fn new(element: impl fmt::Display, kind: SceneErrorKind) -> Self {
        Self { element: element.to_string(), kind }
    }

    pub(crate) fn malformed(element: impl fmt::Display, reason: impl Into<String>) -> Self {
        Self::new(element, SceneErrorKind::Malformed(shortened(reason.into())))
    }

    pub(crate) fn light(element: impl fmt::Display, error: &LightError) -> Self {
        Self::malformed(format_args!("{element}: {}", error.field), error.reason)
    }

    pub(crate) fn unsupported(element: impl fmt::Display, feature: impl Into<String>) -> Self {
        Self::new(element, SceneErrorKind::Unsupported(shortened(feature.into())))
    }

    pub(crate) fn forbidden(element: impl fmt::Display, reference: &str, reason: &'static str) -> Self {
        Self::new(element, SceneErrorKind::Forbidden { reference: shortened(reference.to_owned()), reason })
    }

    pub(crate) fn io(element: impl fmt::Display, error: std::io::Error) -> Self {
        Self::new(element, SceneErrorKind::Io(error))
    }

    pub(crate) fn in_file(self, file: impl Into<String>) -> SceneError {
        SceneError { file: file.into(), element: shortened(self.element), kind: self.kind }
    }
}

/// Fails when `actual` is over `limit`.
pub(crate) fn at_most(element: impl fmt::Display, actual: u64, limit: u64) -> Result<(), Fault> {
    if actual > limit { Err(Fault::new(element, SceneErrorKind::TooLarge { actual, limit })) } else { Ok(()) }
}

/// A message quotes the file, and the file may hold megabytes without a line break.
pub(crate) fn shortened(mut text: String) -> String {
    const MAX_BYTES: usize = 300;
    if text.len() > MAX_BYTES {
        text.truncate((0..=MAX_BYTES).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0));
        text.push('…');
    }
    text
}
