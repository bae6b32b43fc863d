//! The only access to files that a scene refers to; the names in a folder, and names as text.

use std::borrow::Cow;
use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::ffi::OsString;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;

use crate::{Fault, Limits, SceneErrorKind, at_most};

/// A scene's folder. No file outside it is read, and the bytes of all files together are limited.
pub(crate) struct Folder {
    /// The folder's path, without links.
    pub(crate) root: PathBuf,
    bytes_left: Cell<u64>,
    /// The names in folders that were searched, by the folder's path below this one.
    listings: RefCell<HashMap<PathBuf, Rc<Listing>>>,
}

impl Folder {
    /// Opens the folder of the scene file `path`; returns it with that file's bytes.
    pub(crate) fn open(path: &Path, limits: &Limits) -> Result<(Self, Vec<u8>), Fault> {
        let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let root = parent.canonicalize().map_err(|e| Fault::io("folder", e))?;
        let bytes_left = Cell::new(limits.file_bytes);
        let folder = Self { root, bytes_left, listings: RefCell::default() };
        let bytes = folder.read_path("file", path)?;
        Ok((folder, bytes))
    }

    /// Reads a file by its name relative to this folder.
    pub(crate) fn read_name(&self, element: &str, name: &str) -> Result<Vec<u8>, Fault> {
        // Exporters on Windows write backslashes; as separators they are checked like slashes.
        let relative = name.replace('\\', "/");
        if let Some(reason) = reason_to_refuse(&relative) {
            return Err(Fault::forbidden(element, name, reason));
        }
        self.read_relative(element, Path::new(&relative))
    }

    /// The names in a folder below this one, which is read once.
    pub(super) fn listing(&self, relative: &Path) -> Rc<Listing> {
        let mut listings = self.listings.borrow_mut();
        if let Some(listing) = listings.get(relative) {
            return Rc::clone(listing);
        }
        let listing = Rc::new(Listing::read(&self.root.join(relative)));
        listings.insert(relative.to_owned(), Rc::clone(&listing));
        listing
    }

    /// Reads a file by a path below this folder, as a search finds it.
    pub(crate) fn read_relative(&self, element: &str, relative: &Path) -> Result<Vec<u8>, Fault> {
        let path = self.root.join(relative).canonicalize().map_err(|e| Fault::io(element, e))?;
        if !path.starts_with(&self.root) {
            let name = relative.display().to_string();
            return Err(Fault::forbidden(element, &name, "is a link that leaves the scene's folder"));
        }
        self.read_path(element, &path)
    }

    fn read_path(&self, element: &str, path: &Path) -> Result<Vec<u8>, Fault> {
        let metadata = path.metadata().map_err(|e| Fault::io(element, e))?;
        if !metadata.is_file() {
            // A pipe or a device would block or never end.
            return Err(Fault::malformed(element, format!("{} is not a regular file", path.display())));
        }
        at_most(format!("{element}, in bytes"), metadata.len(), self.bytes_left.get())?;
        let mut bytes = Vec::with_capacity(metadata.len() as usize);
        let file = File::open(path).map_err(|e| Fault::io(element, e))?;
        file.take(metadata.len()).read_to_end(&mut bytes).map_err(|e| Fault::io(element, e))?;
        self.bytes_left.set(self.bytes_left.get() - bytes.len() as u64);
        Ok(bytes)
    }
}

/// `None` for a file that does not exist.
pub(crate) fn existing(read: Result<Vec<u8>, Fault>) -> Result<Option<Vec<u8>>, Fault> {
    match read {
        Err(Fault { kind: SceneErrorKind::Io(e), .. }) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
        other => other.map(Some),
    }
}

fn reason_to_refuse(relative: &str) -> Option<&'static str> {
    let path = Path::new(relative);
    if relative.contains('\0') {
        Some("contains a NUL")
    } else if relative.split('/').next().is_some_and(|first| first.contains(':')) {
        Some("names a scheme or a drive")
    } else if relative.is_empty() || relative.starts_with('/') || path.is_absolute() {
        Some("is not a relative file name")
    } else if path.components().any(|c| !matches!(c, Component::Normal(_) | Component::CurDir)) {
        Some("climbs out of the scene's folder")
    } else {
        None
    }
}

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

#[cfg(test)]
mod tests {
    use super::super::file_search::read_uri;
    use super::*;

    fn folder_with_file() -> (tempfile::TempDir, Folder) {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("scene")).unwrap();
        std::fs::write(dir.path().join("secret.bin"), b"secret").unwrap();
        std::fs::write(dir.path().join("scene/a.gltf"), b"{}").unwrap();
        std::fs::write(dir.path().join("scene/a b.bin"), b"inside").unwrap();
        let (folder, bytes) = Folder::open(&dir.path().join("scene/a.gltf"), &Limits::default()).unwrap();
        assert_eq!(bytes, b"{}");
        (dir, folder)
    }

    #[test]
    fn reads_inside_and_decodes_percent() {
        let (_dir, folder) = folder_with_file();
        assert_eq!(read_uri(&folder, "buffer 0", "a%20b.bin").unwrap().unwrap(), b"inside");
        assert_eq!(read_uri(&folder, "buffer 0", "./a b.bin").unwrap().unwrap(), b"inside");
        assert_eq!(read_uri(&folder, "buffer 0", "a%20b.bin?v=3#x").unwrap().unwrap(), b"inside");
        assert_eq!(read_uri(&folder, "buffer 0", "./A%20b.BIN").unwrap().unwrap(), b"inside");
        assert!(read_uri(&folder, "buffer 0", "c.bin").unwrap().is_none());
    }

    #[test]
    fn refuses_every_path_out_of_the_folder() {
        let (dir, folder) = folder_with_file();
        let absolute = dir.path().join("secret.bin").display().to_string();
        let names = [
            "../secret.bin",
            "%2e%2e/secret.bin",
            "%2E%2E%2Fsecret.bin",
            "x/../../secret.bin",
            "..\\secret.bin",
            "%2Fetc/passwd",
            "/etc/passwd",
            "file:///etc/passwd",
            "FILE:secret.bin",
            "http://host/secret.bin",
            "C:\\secret.bin",
            "\\\\host\\share",
            "a%00.bin",
            "a\0.bin",
            "%ff%fe",
            "",
            &absolute,
        ];
        for name in names {
            let fault = read_uri(&folder, "buffer 0", name).unwrap_err().in_file("a.gltf");
            assert!(matches!(fault.kind, SceneErrorKind::Forbidden { .. }), "{name:?}: {fault}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn refuses_links_out_of_the_folder() {
        let (dir, folder) = folder_with_file();
        std::os::unix::fs::symlink(dir.path().join("secret.bin"), dir.path().join("scene/link.bin")).unwrap();
        let fault = folder.read_name("buffer 0", "link.bin").unwrap_err().in_file("a.gltf");
        assert!(matches!(fault.kind, SceneErrorKind::Forbidden { .. }), "{fault}");
    }

    #[test]
    fn the_limit_on_bytes_counts_all_files() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("a.gltf"), [0; 60]).unwrap();
        let limits = Limits { file_bytes: 100, ..Limits::default() };
        let (folder, _) = Folder::open(&dir.path().join("a.gltf"), &limits).unwrap();
        let fault = folder.read_name("buffer 0", "a.gltf").unwrap_err().in_file("a.gltf");
        assert!(matches!(fault.kind, SceneErrorKind::TooLarge { actual: 60, limit: 40 }), "{fault}");
    }
}
