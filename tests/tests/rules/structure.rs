//! The structure of the sources: no circle of imports inside a crate, and no long function.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

use cluster_tests::imports::{ModulePath, circles, imports, imports_of_crate};

use crate::root;

/// Lines from a function's first to its last.
const MAX_FUNCTION_LINES: usize = 100;

/// All files below the workspace with one of these endings.
pub(crate) fn sources(endings: &[&str]) -> Vec<PathBuf> {
    let mut open = vec![root()];
    let mut files = Vec::new();
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).expect("a folder that can be read") {
            let path = entry.expect("an entry").path();
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default().to_owned();
            if path.is_dir() && name != "target" && !name.starts_with('.') {
                open.push(path);
            } else if endings.iter().any(|ending| name.ends_with(ending)) {
                files.push(path);
            }
        }
    }
    files
}

/// The `src` folders of all crates.
fn crates() -> BTreeSet<PathBuf> {
    let manifests = sources(&["Cargo.toml"]);
    let folders = manifests.iter().map(|manifest| manifest.with_file_name("src"));
    folders.filter(|src| src.is_dir()).collect()
}

#[test]
fn no_crate_has_a_circle_of_imports() {
    let crates = crates();
    assert!(crates.len() >= 15, "{} crates", crates.len());
    let found: Vec<_> = crates
        .iter()
        .map(|src| (src, circles(&imports_of_crate(src).expect("sources"))))
        .filter(|(_, circles)| !circles.is_empty())
        .collect();
    assert!(found.is_empty(), "{found:#?}");
}

fn circles_of(sources: &[(&str, &str)]) -> usize {
    let path = |text: &str| -> ModulePath {
        text.split("::").filter(|name| !name.is_empty()).map(ToOwned::to_owned).collect()
    };
    let sources: Vec<_> = sources.iter().map(|(module, text)| (path(module), *text)).collect();
    circles(&imports(&sources).expect("Rust")).len()
}

#[test]
fn circles_are_seen_through_every_kind_of_path() {
    let root = ("", "mod a; mod b; pub use b::{self, B, deep::*};");
    let a = |text| ("a", text);
    let b = ("b", "mod deep; use crate::a::A; pub struct B(A);");
    let deep = ("b::deep", "pub struct Deep;");
    for text in [
        "use crate::b::B; pub struct A(B);",
        "use crate::{b::{B as Other}}; pub struct A(Other);",
        "use super::B; pub struct A(B);",
        "use crate::B; pub struct A(B);",
        "pub struct A; fn f() -> [u8; 2] { crate::b::g(); vec![crate::B::new()]; [0; 2] }",
    ] {
        assert_eq!(circles_of(&[root, a(text), b, deep]), 1, "{text}");
    }
}

#[test]
fn re_exports_tests_and_siblings_are_no_circle() {
    let root = ("", "mod a; mod b; pub use a::A; pub use b::*;");
    let b = ("b", "use crate::A; pub struct B(A);");
    for a in [
        "pub struct A;",
        "pub struct A; #[cfg(test)] mod tests { use crate::B; fn f(_: B) {} }",
        "pub struct A; #[cfg(test)] use crate::b::{B};",
        "use std::fmt; pub struct A(fmt::Error);",
    ] {
        assert_eq!(circles_of(&[root, ("a", a), b]), 0, "{a}");
    }
    let tests = ("a::tests", "use crate::B; fn f(_: B) {}");
    assert_eq!(circles_of(&[root, ("a", "pub struct A; #[cfg(test)] mod tests;"), b, tests]), 0);
    assert_eq!(circles_of(&[root, ("a", "pub struct A; mod tests;"), b, tests]), 0, "a child is not its parent");
}

/// The functions of a formatted text that are longer than allowed, with their lengths.
fn long_functions(text: &str) -> Vec<(String, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let length = |start: usize| {
        let indent = &lines[start][..lines[start].len() - lines[start].trim_start().len()];
        let is_end = |line: &&str| line.strip_prefix(indent).is_some_and(|rest| rest.starts_with('}'));
        let ends_at_once = lines[start].trim_end().ends_with([';', '}']);
        if ends_at_once { 1 } else { lines[start..].iter().position(is_end).map_or(1, |end| end + 1) }
    };
    let starts = (0..lines.len()).filter(|&start| is_function(lines[start]));
    starts
        .map(|start| (lines[start].trim().to_owned(), length(start)))
        .filter(|(_, n)| *n > MAX_FUNCTION_LINES)
        .collect()
}

fn is_function(line: &str) -> bool {
    let before_name = line.split_once("fn ").map(|(before, _)| before.trim());
    before_name.is_some_and(|before| {
        before.split_whitespace().all(|word| {
            word.starts_with("pub")
                || word.starts_with('@')
                || word.ends_with(')')
                || ["async", "const"].contains(&word)
        })
    })
}

#[test]
fn no_function_is_long() {
    let files = sources(&[".rs", ".wgsl"]);
    let shaders = files.iter().filter(|file| file.extension().is_some_and(|ending| ending == "wgsl")).count();
    assert!(shaders >= 20 && files.len() >= 300, "{} files, {shaders} shaders", files.len());
    let found: Vec<_> = files
        .iter()
        .flat_map(|file| {
            let text = fs::read_to_string(file).expect("text");
            long_functions(&text).into_iter().map(move |(function, lines)| (file.clone(), function, lines))
        })
        .collect();
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn a_long_function_is_seen() {
    let body = "    work();\n".repeat(MAX_FUNCTION_LINES - 2);
    for head in ["fn f() {", "    pub(crate) async fn f(", "@compute @workgroup_size(8, 8) fn main() {"] {
        let indent = &head[..head.len() - head.trim_start().len()];
        assert!(long_functions(&format!("{head}\n{body}{indent}}}\n")).is_empty(), "{head}");
        assert_eq!(long_functions(&format!("{head}\n{body}    work();\n{indent}}}\n")).len(), 1, "{head}");
    }
}
