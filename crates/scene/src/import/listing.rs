//! The names in a folder, and names as text.

use std::borrow::Cow;
use std::collections::HashMap;
use std::ffi::OsString;
use std::path::Path;

/// The names in a folder, to be found in any case and encoding.
#[derive(Default)]
pub(crate) struct Listing {
    by_lower_case: HashMap<String, OsString>,
    /// Names that have other letters than ASCII's; `None` for several names that are alike.
    by_skeleton: HashMap<Vec<u8>, Option<OsString>>,
}

impl Listing {
    /// Reads a folder; one that cannot be read has no names.
    pub(crate) fn read(folder: &Path) -> Self {
        let entries = folder.read_dir().into_iter().flatten().flatten();
        let mut names: Vec<OsString> = entries.map(|entry| entry.file_name()).collect();
        // The order of a folder's entries is that of the file system.
        names.sort();
        let mut listing = Self::default();
        for name in names {
            let bytes = name.as_encoded_bytes();
            if !bytes.is_ascii() {
                let alike = listing.by_skeleton.entry(ascii_skeleton(bytes));
                alike.and_modify(|alike| *alike = None).or_insert_with(|| Some(name.clone()));
            }
            listing.by_lower_case.entry(decoded(bytes).to_lowercase()).or_insert(name);
        }
        listing
    }

    pub(crate) fn loosely_named(&self, part: &[u8]) -> Option<&OsString> {
        let same = self.by_lower_case.get(&decoded(part).to_lowercase());
        let is_ascii = part.is_ascii();
        same.or_else(|| self.by_skeleton.get(&ascii_skeleton(part)).filter(|_| !is_ascii)?.as_ref())
    }
}

/// A name in lower case with one mark for each run of other letters than ASCII's: equal for all encodings of the name that
/// leave ASCII alone.
fn ascii_skeleton(name: &[u8]) -> Vec<u8> {
    let mut skeleton: Vec<u8> =
        name.iter().map(|&byte| if byte.is_ascii() { byte.to_ascii_lowercase() } else { 0xff }).collect();
    skeleton.dedup_by(|a, b| *a == 0xff && *b == 0xff);
    skeleton
}

/// Text in UTF-8, or else in Latin-1.
pub(crate) fn decoded(text: &[u8]) -> Cow<'_, str> {
    std::str::from_utf8(text).map_or_else(|_| text.iter().map(|&byte| char::from(byte)).collect(), Cow::Borrowed)
}
