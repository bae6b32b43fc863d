//! The qualities of views whose surfaces come from the scene and whose light comes from samples.

use std::fmt;

/// The certainty that light of samples must have to be used at a point; other points are lit in the view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum LightCacheQuality {
    /// Light of any sample that is near.
    Draft,
    /// Light of samples that surround the point.
    Fast,
    /// Light of samples that surround the point and about agree.
    #[default]
    Balanced,
    /// Light of samples that surround the point closely and agree; other points have all rays.
    Fine,
    /// No light of samples: every point is lit in the view, as in views that are drawn directly.
    Exact,
}

impl LightCacheQuality {
    /// All, by rising quality.
    pub const ALL: [Self; 5] = [Self::Draft, Self::Fast, Self::Balanced, Self::Fine, Self::Exact];

    /// The text of a quality.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Draft => "draft",
            Self::Fast => "fast",
            Self::Balanced => "balanced",
            Self::Fine => "fine",
            Self::Exact => "exact",
        }
    }

    /// The quality of a text; `None` for another text.
    #[must_use]
    pub fn named(text: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|quality| quality.name() == text)
    }

    /// The next lower quality; `None` for the lowest.
    #[must_use]
    pub fn lower(self) -> Option<Self> {
        let place = Self::ALL.iter().position(|&quality| quality == self)?;
        place.checked_sub(1).map(|lower| Self::ALL[lower])
    }
}

impl fmt::Display for LightCacheQuality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
