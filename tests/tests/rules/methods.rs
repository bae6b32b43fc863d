//! No product file outside `methods/` names a method, by its variant or by its text. A method is added by its file pair and
//! its row in a table.

use std::fmt::Debug;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr as _;

use cluster_tests::imports::is_for_tests;
use proc_macro2::{Delimiter, TokenStream, TokenTree};

use crate::root;

/// Folders that name methods: the methods, their twins, and all that measures and tests them.
const MAY_NAME: [&str; 6] = [
    "crates/reconstruction/src/methods",
    "crates/reconstruction/src/scalar",
    "crates/sampling/src/methods",
    "crates/sampling/src/scalar",
    "lab",
    "tests",
];

/// Words that mean something else in a folder: a scene's meshes are no method, and a method that takes surfaces from the scene has
/// its passes where surfaces are found.
const OTHER_MEANINGS: [(&str, &str); 3] =
    [("crates/scene", "mesh"), ("crates/fixtures", "mesh"), ("crates/render", "light_cache")];

/// A closed set of methods.
struct Methods {
    ty: &'static str,
    variants: Vec<String>,
    names: Vec<&'static str>,
}

impl Methods {
    fn new<M: Debug>(ty: &'static str, rows: &[depth_image::NamedMethod<M>]) -> Self {
        let variant = |row: &depth_image::NamedMethod<M>| {
            let debug = format!("{:?}", row.method);
            debug.split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default().to_owned()
        };
        Self { ty, variants: rows.iter().map(variant).collect(), names: rows.iter().map(|row| row.name).collect() }
    }
}

fn all_methods() -> [Methods; 2] {
    [Methods::new("ReconstructionMethod", &reconstruction::METHODS), Methods::new("SamplingMethod", &sampling::METHODS)]
}

/// The variants and texts of methods that a source names outside of its tests and comments.
fn named(source: &str) -> Vec<String> {
    let tokens = TokenStream::from_str(source).expect("Rust");
    let methods = all_methods();
    let mut found = Vec::new();
    find(&tokens.into_iter().collect::<Vec<_>>(), &methods, &mut found);
    found
}

fn find(tokens: &[TokenTree], methods: &[Methods], found: &mut Vec<String>) {
    let mut at = 0;
    while at < tokens.len() {
        match &tokens[at] {
            TokenTree::Punct(punct) if punct.as_char() == '#' && is_for_tests(tokens.get(at + 1)) => {
                at = after_item(tokens, at + 2);
                continue;
            }
            // Comments of items are attributes.
            TokenTree::Punct(punct) if punct.as_char() == '#' && is_comment(tokens.get(at + 1)) => at += 1,
            TokenTree::Ident(ident) => {
                let set = methods.iter().find(|set| *ident == set.ty);
                found.extend(set.into_iter().flat_map(|set| variants_after(&tokens[at + 1..], set)));
            }
            TokenTree::Group(group) => find(&group.stream().into_iter().collect::<Vec<_>>(), methods, found),
            TokenTree::Literal(literal) => {
                found.extend(methods.iter().find_map(|set| text_of(set, &literal.to_string())))
            }
            TokenTree::Punct(_) => {}
        }
        at += 1;
    }
}

fn is_comment(attribute: Option<&TokenTree>) -> bool {
    attribute.is_some_and(|attribute| attribute.to_string().replace(' ', "").starts_with("[doc="))
}

/// The place after an item, which ends with a semicolon or a block.
fn after_item(tokens: &[TokenTree], start: usize) -> usize {
    let ends = |token: &TokenTree| match token {
        TokenTree::Punct(punct) => punct.as_char() == ';',
        TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
        _ => false,
    };
    tokens[start..].iter().position(ends).map_or(tokens.len(), |length| start + length + 1)
}

/// The variants in `::Variant`, `::{Variant, …}` or `::*` after a type.
fn variants_after(tokens: &[TokenTree], set: &Methods) -> Vec<String> {
    let [colon, second, named, ..] = tokens else { return Vec::new() };
    if [colon, second].iter().any(|token| token.to_string() != ":") {
        return Vec::new();
    }
    let is_variant = |name: &str| name == "*" || set.variants.iter().any(|variant| variant == name);
    let names: Vec<String> = match named {
        TokenTree::Group(group) => group.stream().into_iter().map(|token| token.to_string()).collect(),
        other => vec![other.to_string()],
    };
    names.into_iter().filter(|name| is_variant(name)).map(|name| format!("{}::{name}", set.ty)).collect()
}

/// The method that a literal names: a word of two parts anywhere, a plain word where it is the whole text or has a setting.
fn text_of(set: &Methods, literal: &str) -> Option<String> {
    let (_, text) = literal.split_once('"')?;
    let text = text.trim_end_matches('#').trim_end_matches('"');
    let is_named = |name: &&&str| {
        let mut words = text.split(|c: char| !c.is_alphanumeric() && c != '_');
        text.split(':').next() == Some(**name) || (name.contains('_') && words.any(|word| word == **name))
    };
    set.names.iter().find(is_named).map(|name| (*name).to_owned())
}

/// The files that the product is built from, by their paths in the workspace.
fn product_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder that can be read") {
        let path = entry.expect("an entry").path();
        let inside = path.strip_prefix(root()).expect("a path in the workspace").to_owned();
        let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        let is_for_tests = stem == "tests" || stem == "test_support" || stem.ends_with("_tests");
        if MAY_NAME.iter().any(|folder| inside == Path::new(folder)) || is_for_tests || stem.starts_with('.') {
            continue;
        }
        if path.is_dir() && stem != "target" {
            product_files(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(inside);
        }
    }
}

#[test]
fn no_product_file_outside_methods_names_a_method() {
    let mut files = Vec::new();
    product_files(&root(), &mut files);
    assert!(files.len() > 250, "{} files", files.len());
    let mut found = Vec::new();
    for file in &files {
        let source = fs::read_to_string(root().join(file)).expect("text");
        let is_meant =
            |name: &String| !OTHER_MEANINGS.iter().any(|(folder, word)| file.starts_with(folder) && name == word);
        found.extend(named(&source).into_iter().filter(is_meant).map(|name| format!("{}: {name}", file.display())));
    }
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn a_named_method_is_seen_by_its_variant_and_by_its_text() {
    for (source, expected) in [
        ("fn f() -> M { ReconstructionMethod::Mesh }", "ReconstructionMethod::Mesh"),
        (
            "fn f() { matches!(m, reconstruction::ReconstructionMethod::HybridMesh { .. }) }",
            "ReconstructionMethod::HybridMesh",
        ),
        ("use sampling::SamplingMethod::{self, NonRedundant};", "SamplingMethod::NonRedundant"),
        ("use SamplingMethod::*;", "SamplingMethod::*"),
        ("const M: &str = \"joint_carve:2\";", "joint_carve"),
        ("fn f() { println!(\"drawn by light_field_search\") }", "light_field_search"),
        ("const M: &str = \"mesh\";", "mesh"),
        ("const M: &str = r#\"non_redundant:pixel\"#;", "non_redundant"),
    ] {
        assert_eq!(named(source), [expected], "{source}");
    }
}

#[test]
fn defaults_comments_tests_and_plain_words_name_no_method() {
    for source in [
        "fn f() -> M { ReconstructionMethod::default() }",
        "fn f() { SamplingMethod::help(); METHODS[0].method }",
        "/// As joint_carve does.\nfn f() {} // by depth_peeling",
        "const TEXT: &str = \"a mesh of conventional triangles\";",
        "#[cfg(test)] mod tests { const M: &str = \"joint_carve\"; }",
    ] {
        assert_eq!(named(source), [""; 0], "{source}");
    }
}
