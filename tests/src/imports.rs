//! The imports between the modules of one crate, read from its sources.
//!
//! A module uses another where a path (`crate::a::b`, `super::b`, or `b::c` of a child module) leads to it. Re-exports
//! count as the module that defines the item. Modules of tests are left aside.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::str::FromStr as _;
use std::{fs, io};

use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// The path of a module below its crate's root; the root's is empty.
pub type ModulePath = Vec<String>;

/// The modules that each module uses.
pub type Imports = BTreeMap<ModulePath, BTreeSet<ModulePath>>;

/// One name that a `use` declares.
#[derive(Debug)]
struct Use {
    is_public: bool,
    path: Vec<String>,
    /// The name in this module; `*` for all names.
    name: String,
}

/// The contents of one file.
#[derive(Debug, Default)]
struct Module {
    uses: Vec<Use>,
    /// Paths of two and more names outside of `use`.
    paths: Vec<Vec<String>>,
    /// All names outside of `use`.
    names: BTreeSet<String>,
    /// Modules that are compiled for tests alone.
    test_modules: BTreeSet<String>,
}

/// Reads all files below `src`.
///
/// # Errors
/// For a folder that cannot be read, or a file that is not Rust.
pub fn imports_of_crate(src: &Path) -> io::Result<Imports> {
    let mut sources = Vec::new();
    read_folder(src, &mut Vec::new(), &mut sources)?;
    imports(&sources.iter().map(|(path, text)| (path.clone(), text.as_str())).collect::<Vec<_>>())
        .map_err(|error| io::Error::other(format!("{}: {error}", src.display())))
}

fn read_folder(folder: &Path, path: &mut ModulePath, sources: &mut Vec<(ModulePath, String)>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let file = entry?.path();
        let stem = file.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default().to_owned();
        if file.is_dir() && !(path.is_empty() && stem == "bin") {
            path.push(stem);
            read_folder(&file, path, sources)?;
            path.pop();
        } else if file.extension().is_some_and(|extension| extension == "rs") {
            let is_root = path.is_empty() && ["lib", "main"].contains(&stem.as_str());
            let own = if stem == "mod" || is_root { path.clone() } else { [path.clone(), vec![stem]].concat() };
            sources.push((own, fs::read_to_string(&file)?));
        }
    }
    Ok(())
}

/// The imports between modules of these texts.
///
/// # Errors
/// For a text that is not Rust.
pub fn imports(sources: &[(ModulePath, &str)]) -> Result<Imports, String> {
    let mut modules = BTreeMap::new();
    for (path, text) in sources {
        let tokens = TokenStream::from_str(text).map_err(|error| format!("{path:?}: {error}"))?;
        let mut module = Module::default();
        module.read(&tokens.into_iter().collect::<Vec<_>>());
        modules.insert(path.clone(), module);
    }
    let test_modules: Vec<ModulePath> = modules
        .iter()
        .flat_map(|(path, module)| module.test_modules.iter().map(|name| [path.clone(), vec![name.clone()]].concat()))
        .collect();
    modules.retain(|path, _| !test_modules.iter().any(|test| path.starts_with(test)));
    let of = |path: &ModulePath| Graph(&modules).used_by(path);
    Ok(modules.keys().map(|path| (path.clone(), of(path))).collect())
}

/// The groups of modules that use one another, directly or through others.
#[must_use]
pub fn circles(imports: &Imports) -> Vec<BTreeSet<ModulePath>> {
    let reached: BTreeMap<_, _> = imports.keys().map(|module| (module, reachable(imports, module))).collect();
    let with = |module: &ModulePath| -> BTreeSet<ModulePath> {
        reached[module].iter().filter(|other| reached[*other].contains(module)).cloned().collect()
    };
    let groups: BTreeSet<_> = imports.keys().filter(|module| reached[*module].contains(*module)).map(with).collect();
    groups.into_iter().collect()
}

fn reachable(imports: &Imports, from: &ModulePath) -> BTreeSet<ModulePath> {
    let mut found = BTreeSet::new();
    let mut open = vec![from];
    while let Some(module) = open.pop() {
        open.extend(imports[module].iter().filter(|used| found.insert((*used).clone())));
    }
    found
}

impl Module {
    fn read(&mut self, tokens: &[TokenTree]) {
        let mut at = 0;
        while at < tokens.len() {
            at = match &tokens[at] {
                TokenTree::Punct(punct) if punct.as_char() == '#' && is_for_tests(tokens.get(at + 1)) => {
                    self.pass_test_item(tokens, at + 2)
                }
                TokenTree::Ident(ident) if *ident == "use" => self.read_use(tokens, at),
                TokenTree::Ident(_) => self.read_path(tokens, at),
                TokenTree::Group(group) => {
                    self.read(&group.stream().into_iter().collect::<Vec<_>>());
                    at + 1
                }
                _ => at + 1,
            }
        }
    }

    /// Passes over an item that only tests have; gives the place after it.
    fn pass_test_item(&mut self, tokens: &[TokenTree], start: usize) -> usize {
        let is_use = tokens[start..].iter().take(4).any(|token| token.to_string() == "use");
        let ends = |token: &TokenTree| match token {
            TokenTree::Punct(punct) => punct.as_char() == ';',
            TokenTree::Group(group) => group.delimiter() == Delimiter::Brace && !is_use,
            _ => false,
        };
        let end = tokens[start..].iter().position(ends).map_or(tokens.len(), |length| start + length + 1);
        let names: Vec<String> = tokens[start..end].iter().map(ToString::to_string).collect();
        if let Some(place) = names.iter().position(|name| name == "mod") {
            self.test_modules.extend(names.get(place + 1).cloned());
        }
        end
    }

    fn read_use(&mut self, tokens: &[TokenTree], at: usize) -> usize {
        let is_public = tokens[..at].iter().rev().take(2).any(|token| token.to_string() == "pub");
        let is_end = |token: &TokenTree| token.to_string() == ";";
        let length = tokens[at..].iter().position(is_end).unwrap_or(tokens.len() - at);
        self.read_use_tree(&tokens[at + 1..at + length], &[], is_public);
        at + length
    }

    fn read_use_tree(&mut self, tree: &[TokenTree], before: &[String], is_public: bool) {
        for branch in tree.split(|token| token.to_string() == ",").filter(|branch| !branch.is_empty()) {
            let mut path = before.to_vec();
            let end = branch.iter().position(|token| token.to_string() == "as").unwrap_or(branch.len());
            path.extend(branch[..end].iter().filter(|token| is_segment(token)).map(name_of));
            match branch.last() {
                Some(TokenTree::Group(group)) => {
                    self.read_use_tree(&group.stream().into_iter().collect::<Vec<_>>(), &path, is_public);
                }
                last => {
                    let name = last.map(name_of).unwrap_or_default();
                    self.uses.push(Use { is_public, path, name });
                }
            }
        }
    }

    fn read_path(&mut self, tokens: &[TokenTree], at: usize) -> usize {
        let mut path = vec![name_of(&tokens[at])];
        let mut next = at + 1;
        while is_double_colon(tokens, next) {
            let Some(TokenTree::Ident(_)) = tokens.get(next + 2) else { break };
            path.push(name_of(&tokens[next + 2]));
            next += 3;
        }
        self.names.extend(path.iter().cloned());
        if path.len() > 1 {
            self.paths.push(path);
        }
        next
    }
}

/// Returns whether a token is a name, or the star for all names.
fn is_segment(token: &TokenTree) -> bool {
    matches!(token, TokenTree::Ident(_)) || token.to_string() == "*"
}

fn name_of(token: &TokenTree) -> String {
    token.to_string().trim_start_matches("r#").to_owned()
}

fn is_double_colon(tokens: &[TokenTree], at: usize) -> bool {
    [at, at + 1].iter().all(|place| tokens.get(*place).is_some_and(|token| token.to_string() == ":"))
}

/// Returns whether an attribute is `cfg(test)`, or `cfg(all(test, …))`.
#[must_use]
pub fn is_for_tests(attribute: Option<&TokenTree>) -> bool {
    let text = attribute.map(ToString::to_string).unwrap_or_default().replace(' ', "");
    text.starts_with("[cfg(test") || text.starts_with("[cfg(all(test")
}

/// All modules by path.
struct Graph<'a>(&'a BTreeMap<ModulePath, Module>);

impl Graph<'_> {
    fn used_by(&self, own: &ModulePath) -> BTreeSet<ModulePath> {
        let module = &self.0[own];
        // A name that is only re-exported is not used here.
        let is_used = |declared: &&Use| !declared.is_public || module.names.contains(&declared.name);
        let imported = module.uses.iter().filter(is_used).map(|declared| &declared.path);
        let paths = imported.chain(&module.paths).filter_map(|path| self.absolute(own, path));
        paths.map(|path| self.definer(path, 0)).filter(|used| used != own).collect()
    }

    /// A path from the crate's root; `None` for one that leads out of the crate.
    fn absolute(&self, own: &ModulePath, path: &[String]) -> Option<Vec<String>> {
        let supers = path.iter().take_while(|name| *name == "super").count();
        match path.first()?.as_str() {
            "crate" => Some(path[1..].to_vec()),
            "self" => Some([own, &path[1..]].concat()),
            "super" => Some([&own[..own.len().checked_sub(supers)?], &path[supers..]].concat()),
            name => {
                let child = [own.clone(), vec![name.to_owned()]].concat();
                self.0.contains_key(&child).then(|| [own, path].concat())
            }
        }
    }

    /// The module that defines what a path names, through re-exports.
    fn definer(&self, path: Vec<String>, depth: usize) -> ModulePath {
        let length = (0..=path.len()).rev().find(|length| self.0.contains_key(&path[..*length])).unwrap_or(0);
        let (module, rest) = path.split_at(length);
        let Some(name) = rest.first().filter(|_| depth < 16) else { return module.to_vec() };
        let re_exported = self.0.get(module).into_iter().flat_map(|module| &module.uses).find_map(|declared| {
            let target = self.absolute(&module.to_vec(), &declared.path)?;
            match declared.name.as_str() {
                "*" => {
                    let inner = &target[..target.len() - 1];
                    let has = self.0.get(inner).is_some_and(|inner| inner.names.contains(name));
                    (has && inner != module).then(|| [inner, rest].concat())
                }
                own if own == name => Some([&target, &rest[1..]].concat()),
                _ => None,
            }
        });
        re_exported.map_or_else(|| module.to_vec(), |target| self.definer(target, depth + 1))
    }
}
