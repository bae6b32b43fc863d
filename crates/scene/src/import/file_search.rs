//! Files that scene files name: in any encoding, in wrong case, with the folders of another computer.
//!
//! Names are compared as bytes before they are decoded. A file is looked for in several folders in turn; no file outside the
//! scene's folder is found.

use std::ffi::OsString;
use std::path::{Component, Path, PathBuf};

use percent_encoding::percent_decode_str;

use super::folder::{Folder, existing};
use super::{Warnings, decoded};
use crate::{Fault, shortened};

/// The result of a search.
pub(crate) enum Found {
    /// The path below the scene's folder.
    File(PathBuf),
    Missing,
    /// The name leads out of the scene's folder, and no file in it has the name's last part.
    Outside(&'static str),
}

/// Finds the first of `names`, spellings of one file name, in the first of `bases`, folders relative to the scene's folder.
/// A file of exactly that name comes before one whose name differs in case or encoding, and that before one that has only the
/// last part of the name.
pub(crate) fn search(folder: &Folder, bases: &[&Path], names: &[&[u8]], warnings: &Warnings) -> Found {
    let bases = &distinct(bases);
    let names = &distinct(names);
    let mut outside = None;
    for (by_last_part, matching) in
        [(false, Matching::Exact), (false, Matching::Loose), (true, Matching::Exact), (true, Matching::Loose)]
    {
        for name in names {
            let ReferredName { mut parts, is_absolute } = ReferredName::parse(name);
            if by_last_part {
                parts.drain(..parts.len().saturating_sub(1));
                parts.retain(|last| *last != b".." && !last.contains(&0));
            } else if is_absolute {
                continue;
            }
            for base in bases {
                match resolved(folder, base, &parts, matching) {
                    Found::File(path) if by_last_part => {
                        let name = shortened(decoded(name).into_owned());
                        let warning = "missing files are replaced by files of the same name in other folders";
                        warnings.list(warning, format_args!("{name} by {}", path.display()));
                        return Found::File(path);
                    }
                    Found::File(path) => return Found::File(path),
                    Found::Outside(reason) if !by_last_part => outside = outside.or(Some(reason)),
                    Found::Outside(_) | Found::Missing => {}
                }
            }
        }
    }
    outside.map_or(Found::Missing, Found::Outside)
}

fn distinct<T: PartialEq + Copy>(items: &[T]) -> Vec<T> {
    let mut distinct = Vec::with_capacity(items.len());
    for item in items {
        if !distinct.contains(item) {
            distinct.push(*item);
        }
    }
    distinct
}

/// Reads a file named by a URI reference, as in glTF; percent-encoding is decoded first. Where there is no such file,
/// the name counts without its query (`?…`), and then without regard to upper and lower case. `None` for a file that
/// does not exist.
pub(crate) fn read_uri(folder: &Folder, element: &str, uri: &str) -> Result<Option<Vec<u8>>, Fault> {
    let name = percent_decode_str(uri).decode_utf8();
    let name = name.map_err(|_| Fault::forbidden(element, uri, "is not UTF-8 once decoded"))?;
    if let Some(bytes) = existing(folder.read_name(element, &name))? {
        return Ok(Some(bytes));
    }
    let path = uri.split(['?', '#']).next().and_then(|path| percent_decode_str(path).decode_utf8().ok());
    let Some(path) = path.filter(|path| !path.is_empty()) else { return Ok(None) };
    if let Some(bytes) = existing(folder.read_name(element, &path))? {
        return Ok(Some(bytes));
    }
    let name = ReferredName::parse(path.as_bytes());
    match resolved(folder, Path::new(""), &name.parts, Matching::Loose) {
        Found::File(path) if !name.is_absolute => existing(folder.read_relative(element, &path)),
        _ => Ok(None),
    }
}

/// A name in parts, without the root of another computer.
struct ReferredName<'n> {
    parts: Vec<&'n [u8]>,
    is_absolute: bool,
}

impl<'n> ReferredName<'n> {
    fn parse(name: &'n [u8]) -> Self {
        let has_scheme = name.split(is_separator).next().is_some_and(|first| first.contains(&b':'));
        let is_absolute = has_scheme || name.first().is_some_and(is_separator);
        // A drive may stand before a name without a separator: `C:t.png`.
        let after_drive = name.iter().position(|&byte| byte == b':').filter(|_| has_scheme).map_or(0, |at| at + 1);
        let parts = name[after_drive..].split(is_separator).filter(|part| !part.is_empty() && *part != b".");
        Self { parts: parts.collect(), is_absolute }
    }
}

fn is_separator(byte: &u8) -> bool {
    matches!(byte, b'/' | b'\\')
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Matching {
    Exact,
    /// The name may differ in case and encoding.
    Loose,
}

fn resolved(folder: &Folder, base: &Path, parts: &[&[u8]], matching: Matching) -> Found {
    let mut relative = base.to_owned();
    for part in parts {
        if *part == b".." {
            if !relative.pop() {
                return Found::Outside("climbs out of the scene's folder");
            }
            continue;
        }
        let Some(name) = entry_name(folder, &relative, part, matching) else { return Found::Missing };
        relative.push(name);
    }
    let is_normal = relative.components().all(|c| matches!(c, Component::Normal(_)));
    match folder.root.join(&relative).canonicalize() {
        _ if parts.is_empty() || !is_normal => Found::Missing,
        Ok(path) if !path.starts_with(&folder.root) => Found::Outside("is a link that leaves the scene's folder"),
        Ok(path) if path.is_file() => Found::File(relative),
        _ => Found::Missing,
    }
}

/// The name in a folder below the scene's that matches `part`.
fn entry_name(folder: &Folder, relative: &Path, part: &[u8], matching: Matching) -> Option<OsString> {
    if part.contains(&0) {
        return None;
    }
    let path = folder.root.join(relative);
    let exact = os_name(part).filter(|name| path.join(name).symlink_metadata().is_ok());
    if exact.is_some() || matching == Matching::Exact {
        return exact;
    }
    folder.listing(relative).loosely_named(part).cloned()
}

#[cfg(unix)]
#[allow(clippy::unnecessary_wraps, reason = "elsewhere not all bytes are names")]
fn os_name(part: &[u8]) -> Option<OsString> {
    use std::os::unix::ffi::OsStringExt;
    Some(OsString::from_vec(part.to_vec()))
}

#[cfg(not(unix))]
fn os_name(part: &[u8]) -> Option<OsString> {
    std::str::from_utf8(part).ok().map(OsString::from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Limits;

    fn found(files: &[&str], bases: &[&str], name: &[u8]) -> String {
        let dir = tempfile::tempdir().unwrap();
        for file in ["scene/a.obj"].iter().chain(files) {
            let path = dir.path().join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, b"x").unwrap();
        }
        let (folder, _) = Folder::open(&dir.path().join("scene/a.obj"), &Limits::default()).unwrap();
        let bases: Vec<&Path> = bases.iter().map(Path::new).collect();
        match search(&folder, &bases, &[name], &Warnings::default()) {
            Found::File(path) => path.display().to_string(),
            Found::Missing => "missing".into(),
            Found::Outside(_) => "outside".into(),
        }
    }

    #[test]
    fn the_exact_name_comes_first_and_then_other_cases() {
        assert_eq!(found(&["scene/T.png", "scene/t.png"], &[""], b"t.png"), "t.png");
        assert_eq!(found(&["scene/Maps/T.png"], &[""], b"maps\\t.PNG"), "Maps/T.png");
        assert_eq!(found(&["scene/T.png", "scene/m/t.png"], &["", "m"], b"t.png"), "m/t.png", "exact in any folder");
    }

    #[test]
    fn names_in_other_encodings_are_found() {
        assert_eq!(found(&["scene/Öl.png"], &[""], b"\xd6l.png"), "Öl.png", "Latin-1");
        assert_eq!(found(&["scene/木.png"], &[""], b"\x96\xd8.png"), "木.png", "Shift JIS");
        assert_eq!(found(&["scene/木.png", "scene/水.png"], &[""], b"\x96\xd8.png"), "missing", "two are alike");
    }

    #[test]
    fn a_folder_is_read_once_for_many_names() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("a.obj"), b"x").unwrap();
        for number in 0..100 {
            std::fs::write(dir.path().join(format!("T{number}.PNG")), b"x").unwrap();
        }
        let limits = Limits::default();
        let (folder, _) = Folder::open(&dir.path().join("a.obj"), &limits).unwrap();
        let warnings = Warnings::default();
        let bases = [Path::new(""), Path::new("")];
        for number in 0..100 {
            let name = format!("t{number}.png");
            let found = search(&folder, &bases, &[name.as_bytes(), name.as_bytes()], &warnings);
            assert!(matches!(found, Found::File(path) if path == Path::new(&format!("T{number}.PNG"))));
        }
        let listing = folder.listing(Path::new(""));
        assert!(std::rc::Rc::ptr_eq(&listing, &folder.listing(Path::new(""))));
    }

    #[test]
    fn absolute_names_are_found_by_their_last_part() {
        for name in
            ["C:\\a\\t.png", "C:t.png", "/home/x/t.png", "\\\\host\\share\\t.png", "file:///x/t.png", "no/t.png"]
        {
            assert_eq!(found(&["scene/t.png"], &[""], name.as_bytes()), "t.png", "{name}");
        }
    }

    #[test]
    fn nothing_outside_the_folder_is_found() {
        let files = ["secret.png", "scene/m/a.mtl"];
        for name in
            ["../secret.png", "..\\secret.png", "../../secret.png", "x/../../secret.png", "/etc/passwd", "C:\\x.png"]
        {
            assert!(["outside", "missing"].contains(&&*found(&files, &["m", ""], name.as_bytes())), "{name}");
        }
        assert_eq!(found(&files, &[""], b"../secret.png"), "outside");
        assert_eq!(found(&["scene/maps/t.png"], &["m"], b"../maps/t.png"), "maps/t.png", "within the scene's folder");
        assert_eq!(found(&[], &[""], b"a\0.png"), "missing");
        assert_eq!(found(&["scene/maps/t.png"], &[""], b"maps"), "missing", "a folder is no file");
    }
}
