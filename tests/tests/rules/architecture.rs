//! The invariants of ARCHITECTURE.md, checked on the crate graph and on the sources.
//!
//! Each check is a function from what is there to what is wrong with it, so that a second test can show
//! that it sees a fault.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use cargo_metadata::{DependencyKind, Metadata, MetadataCommand};

use crate::root;

/// Which crates of the workspace each one may use, in programs and build scripts. Other uses are not
/// allowed.
const ALLOWED: &[(&str, &[&str])] = &[
    ("depth-image", &[]),
    ("scene", &["depth-image"]),
    ("fixtures", &["scene", "depth-image"]),
    ("gpu", &["depth-image"]),
    ("render", &["gpu", "scene", "depth-image"]),
    ("sampling", &["render", "gpu", "scene", "depth-image"]),
    ("reconstruction", &["gpu", "depth-image"]),
    ("metrics", &["depth-image"]),
    ("pictures", &["metrics", "depth-image"]),
    ("planner", &[]),
    ("codec", &["depth-image"]),
    ("cluster", &["planner", "codec", "depth-image"]),
    ("wire", &["cluster", "codec", "depth-image"]),
    ("node", &["wire", "cluster", "codec", "depth-image"]),
    ("sampler-node", &["node", "wire", "cluster", "codec", "depth-image"]),
    ("compositor-node", &["node", "wire", "cluster", "codec", "depth-image"]),
    ("node-host", &["sampler-node", "compositor-node", "probe", "node", "wire", "cluster"]),
    ("coordinator", &["node", "planner", "wire", "cluster", "codec", "depth-image"]),
    ("client", &["wire", "cluster", "codec", "depth-image"]),
    ("gateway", &["client", "wire", "cluster", "codec", "metrics", "pictures", "depth-image"]),
    ("browser", &[]),
    ("network-proxy", &[]),
    ("simulation", &["client", "coordinator", "cluster", "depth-image"]),
    ("report", &["pictures"]),
    ("probe", &["planner", "metrics", "node", "cluster", "codec", "depth-image"]),
    ("engine", &["node", "reconstruction", "sampling", "render", "gpu", "scene", "cluster", "depth-image"]),
    (
        "app-core",
        &[
            "client",
            "cluster",
            "codec",
            "coordinator",
            "depth-image",
            "engine",
            "gpu",
            "node",
            "node-host",
            "pictures",
            "planner",
            "probe",
            "reconstruction",
            "render",
            "report",
            "sampling",
            "scene",
        ],
    ),
    (
        "lab",
        &[
            "app-core",
            "browser",
            "client",
            "cluster",
            "codec",
            "coordinator",
            "depth-image",
            "engine",
            "fixtures",
            "gpu",
            "metrics",
            "network-proxy",
            "node",
            "pictures",
            "planner",
            "probe",
            "reconstruction",
            "render",
            "report",
            "sampling",
            "scene",
            "simulation",
            "wire",
        ],
    ),
    (
        "myriorama",
        &[
            "app-core",
            "client",
            "cluster",
            "codec",
            "coordinator",
            "depth-image",
            "engine",
            "gateway",
            "metrics",
            "node",
            "node-host",
            "pictures",
            "planner",
            "probe",
            "reconstruction",
            "render",
            "report",
            "sampling",
            "scene",
            "wire",
        ],
    ),
    (
        "cluster-tests",
        &[
            "client",
            "cluster",
            "codec",
            "coordinator",
            "depth-image",
            "gateway",
            "network-proxy",
            "node",
            "node-host",
            "planner",
            "wire",
        ],
    ),
    ("browser-tests", &["browser", "cluster", "cluster-tests", "network-proxy"]),
];

/// Crates that work on pictures in different ways, and never use one another, not even in tests.
const STRANGERS: [&str; 2] = ["sampling", "reconstruction"];

/// Crates that only `wire` may name.
const MESSAGES: [&str; 5] = ["prost", "prost-types", "prost-build", "tonic-prost", "tonic-prost-build"];

/// Crates that a thin client must not link.
const DEVICE: [&str; 5] = ["wgpu", "wgpu-core", "wgpu-hal", "naga", "ash"];

/// Crates of the laboratory, which the program must not link.
const LAB: [&str; 5] = ["browser", "fixtures", "lab", "network-proxy", "simulation"];

/// Text of code that a decision may not depend on.
const IMPURE: [&str; 8] =
    [".await", "async fn", "Instant::now", "SystemTime", "tokio::", "std::thread", "std::env", "std::fs"];

type Arrow = (String, String);

/// The crate graph as Cargo resolves it for this machine. Offline: what a test run needs is there already.
fn graph() -> &'static Metadata {
    static GRAPH: OnceLock<Metadata> = OnceLock::new();
    GRAPH.get_or_init(|| {
        let options = ["--filter-platform".to_owned(), host(), "--offline".to_owned()];
        MetadataCommand::new()
            .manifest_path(root().join("Cargo.toml"))
            .other_options(options)
            .exec()
            .expect("cargo metadata")
    })
}

/// The target that this machine compiles for, as `rustc` calls it.
fn host() -> String {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let output = Command::new(rustc).arg("-vV").output().expect("rustc runs");
    let text = String::from_utf8(output.stdout).expect("text");
    text.lines().find_map(|line| line.strip_prefix("host: ")).expect("a line with the host").to_owned()
}

fn members() -> BTreeSet<String> {
    graph().workspace_packages().into_iter().map(|package| package.name.to_string()).collect()
}

/// Every dependency that a member declares, wherever it comes from.
fn declared(kinds: &[DependencyKind]) -> Vec<Arrow> {
    let of = |package: &cargo_metadata::Package| {
        let used = package.dependencies.iter().filter(|dependency| kinds.contains(&dependency.kind));
        used.map(|dependency| (package.name.to_string(), dependency.name.clone())).collect::<Vec<_>>()
    };
    graph().workspace_packages().into_iter().flat_map(of).collect()
}

const PROGRAM: [DependencyKind; 2] = [DependencyKind::Normal, DependencyKind::Build];
const ANY: [DependencyKind; 3] = [DependencyKind::Normal, DependencyKind::Build, DependencyKind::Development];

fn arrow(from: &str, to: &str) -> Arrow {
    (from.to_owned(), to.to_owned())
}

/// Arrows between members that the table does not have, and members without a row.
fn forbidden(members: &BTreeSet<String>, arrows: &[Arrow]) -> Vec<String> {
    let table: BTreeMap<&str, &[&str]> = ALLOWED.iter().copied().collect();
    let unknown = members.iter().filter(|name| !table.contains_key(name.as_str()));
    let gone = table.keys().filter(|name| !members.contains(**name));
    let wrong = arrows.iter().filter(|(from, to)| {
        members.contains(to) && !table.get(from.as_str()).is_some_and(|row| row.contains(&to.as_str()))
    });
    unknown
        .map(|name| format!("{name} has no row in ALLOWED"))
        .chain(gone.map(|name| format!("{name} has a row and is no member")))
        .chain(wrong.map(|(from, to)| format!("{from} -> {to}")))
        .collect()
}

fn between_strangers(arrows: &[Arrow]) -> Vec<&Arrow> {
    let stranger = |name: &String| STRANGERS.contains(&name.as_str());
    arrows.iter().filter(|(from, to)| from != to && stranger(from) && stranger(to)).collect()
}

fn naming_messages(arrows: &[Arrow]) -> Vec<&Arrow> {
    arrows.iter().filter(|(from, to)| from != "wire" && MESSAGES.contains(&to.as_str())).collect()
}

/// All packages that come with one, itself included.
fn closure(of: &str, uses: &BTreeMap<String, BTreeSet<String>>) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut waiting = vec![of.to_owned()];
    while let Some(name) = waiting.pop() {
        waiting.extend(uses.get(&name).into_iter().flatten().filter(|used| !found.contains(*used)).cloned());
        found.insert(name);
    }
    found
}

/// The packages that each package uses in a program, outside crates too.
fn resolved() -> BTreeMap<String, BTreeSet<String>> {
    let graph = graph();
    let resolve = graph.resolve.as_ref().expect("a resolved graph");
    let name = |id: &cargo_metadata::PackageId| graph[id].name.to_string();
    let normal = |used: &&cargo_metadata::NodeDep| used.dep_kinds.iter().any(|k| k.kind == DependencyKind::Normal);
    let mut uses: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for node in &resolve.nodes {
        let used = node.deps.iter().filter(normal).map(|used| name(&used.pkg));
        uses.entry(name(&node.id)).or_default().extend(used);
    }
    uses
}

fn device_crates(of: &BTreeSet<String>) -> Vec<&str> {
    DEVICE.into_iter().filter(|name| of.contains(*name)).collect()
}

fn sources(folder: &Path, extension: &str) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    let mut waiting = vec![folder.to_owned()];
    while let Some(folder) = waiting.pop() {
        for entry in fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                waiting.push(path);
            } else if path.extension().is_some_and(|e| e == extension) {
                let text = fs::read_to_string(&path).expect("text");
                found.push((path, text));
            }
        }
    }
    found
}

/// Lines of code, not of comments, that hold one of `words`.
fn lines_with(source: &str, words: &[&str]) -> Vec<String> {
    let code = source.lines().filter(|line| !line.trim_start().starts_with("//"));
    code.filter(|line| words.iter().any(|word| line.contains(word))).map(|line| line.trim().to_owned()).collect()
}

/// A key of a section of a manifest; the few that are looked up stand on lines of their own.
fn setting<'t>(manifest: &'t str, section: &str, key: &str) -> Option<&'t str> {
    let mut lines = manifest.lines().map(str::trim).skip_while(|line| *line != format!("[{section}]")).skip(1);
    lines.by_ref().take_while(|line| !line.starts_with('[')).find_map(|line| {
        let (name, value) = line.split_once('=')?;
        (name.trim() == key).then_some(value.trim())
    })
}

#[test]
fn crates_use_only_what_the_table_allows() {
    let arrows = declared(&PROGRAM);
    assert!(arrows.contains(&arrow("render", "gpu")), "the graph was read");
    assert_eq!(forbidden(&members(), &arrows), Vec::<String>::new());
}

#[test]
fn a_new_arrow_a_new_crate_and_a_lost_crate_are_found() {
    let all = members();
    assert_eq!(forbidden(&all, &[arrow("client", "gpu")]), ["client -> gpu"]);
    assert_eq!(forbidden(&all, &[arrow("depth-image", "scene")]), ["depth-image -> scene"]);
    let mut more = all.clone();
    more.insert("shortcut".to_owned());
    assert_eq!(forbidden(&more, &[]), ["shortcut has no row in ALLOWED"]);
    let fewer = all.into_iter().filter(|name| name != "metrics").collect();
    assert_eq!(forbidden(&fewer, &[]), ["metrics has a row and is no member"]);
}

#[test]
fn sampling_and_reconstruction_never_use_one_another() {
    assert!(between_strangers(&declared(&ANY)).is_empty(), "{:?}", between_strangers(&declared(&ANY)));
    assert_eq!(between_strangers(&[arrow("sampling", "reconstruction"), arrow("sampling", "render")]).len(), 1);
}

#[test]
fn only_wire_names_messages() {
    let arrows = declared(&ANY);
    assert!(arrows.contains(&arrow("wire", "prost")), "the graph was read");
    assert!(naming_messages(&arrows).is_empty(), "{:?}", naming_messages(&arrows));
    assert_eq!(naming_messages(&[arrow("client", "prost"), arrow("wire", "prost")]).len(), 1);
}

#[test]
fn thin_clients_link_no_graphics() {
    let uses = resolved();
    for name in ["client", "gateway"] {
        let thin = closure(name, &uses);
        assert!(thin.contains("wire") && thin.contains("tonic"), "the graph was read");
        assert_eq!(device_crates(&thin), Vec::<&str>::new(), "{name}");
    }
    assert!(device_crates(&closure("reconstruction", &uses)).contains(&"wgpu"), "the check sees wgpu where it is");
}

#[test]
fn codecs_need_no_rpc_and_no_runtime() {
    const RPC: [&str; 3] = ["prost", "tonic", "tokio"];
    let uses = resolved();
    let rpc_crates = |of: &str| RPC.into_iter().filter(|name| closure(of, &uses).contains(*name)).collect::<Vec<_>>();
    assert!(closure("codec", &uses).contains("lz4_flex"), "the graph was read");
    assert_eq!(rpc_crates("codec"), [""; 0]);
    assert_eq!(rpc_crates("cluster"), [""; 0]);
    assert_eq!(rpc_crates("wire"), RPC, "the check sees them where they are");
}

#[test]
fn services_see_the_device_through_the_engine_only() {
    let uses = resolved();
    for name in ["node", "sampler-node", "compositor-node", "node-host", "coordinator"] {
        assert_eq!(device_crates(&closure(name, &uses)), Vec::<&str>::new(), "{name}");
    }
}

#[test]
fn the_program_links_no_laboratory() {
    let uses = resolved();
    let lab_crates = |of: &str| {
        let linked = closure(of, &uses);
        LAB.into_iter().filter(|name| linked.contains(*name)).collect::<Vec<_>>()
    };
    assert_eq!(lab_crates("myriorama"), Vec::<&str>::new());
    assert_eq!(lab_crates("lab"), LAB, "the check sees the laboratory where it is");
}

/// The packages of a selection with their versions and features.
fn features(selection: &[&str]) -> BTreeSet<String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut tree = Command::new(cargo);
    tree.current_dir(root()).args(["tree", "--offline", "--prefix", "none", "--format", "{p} {f}"]);
    let output = tree.args(selection).output().expect("cargo tree runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("text");
    // A package that is named again has a mark.
    text.lines().map(|line| line.trim_end_matches(" (*)").to_owned()).collect()
}

#[test]
fn programs_and_tests_share_one_build_of_every_crate() {
    let all = features(&["--workspace", "--edges", "normal,build,dev"]);
    for package in ["myriorama", "lab"] {
        let program = features(&["--package", package, "--edges", "normal,build"]);
        assert!(program.iter().any(|line| line.starts_with("wgpu v")), "the tree was read");
        assert_eq!(program.difference(&all).collect::<Vec<_>>(), Vec::<&String>::new(), "{package}");
        assert!(all.difference(&program).count() > 0, "a crate of tests alone is seen as different");
    }
}

#[test]
fn the_schedule_neither_waits_nor_reads_a_clock() {
    let mut files = sources(&root().join("coordinator/src/schedule"), "rs");
    files.extend(sources(&root().join("simulation/src"), "rs"));
    files.extend(sources(&root().join("crates/planner/src"), "rs"));
    for read in ["balance.rs", "world.rs", "moments.rs"] {
        assert!(files.iter().any(|(path, _)| path.ends_with(read)), "{read} was read");
    }
    for (path, text) in &files {
        assert_eq!(lines_with(text, &IMPURE), Vec::<String>::new(), "{}", path.display());
    }
    assert_eq!(lines_with("// .await\n let t = Instant::now();", &IMPURE), ["let t = Instant::now();"]);
}

/// A clock that is set, by a person or over the network, moves no deadline.
#[test]
fn services_read_monotonic_time_only() {
    const SERVICES: [&str; 10] = [
        "client",
        "compositor-node",
        "coordinator",
        "crates/cluster",
        "crates/codec",
        "crates/node",
        "crates/wire",
        "node-host",
        "sampler-node",
        "tests/src",
    ];
    let files: Vec<_> = SERVICES.into_iter().flat_map(|folder| sources(&root().join(folder), "rs")).collect();
    assert!(files.len() > 50, "{}", files.len());
    assert!(files.iter().any(|(_, text)| !lines_with(text, &["Instant::now()"]).is_empty()));
    for (path, text) in &files {
        assert_eq!(lines_with(text, &["SystemTime", "UNIX_EPOCH"]), [""; 0], "{}", path.display());
    }
}

#[test]
fn only_a_frame_submits_and_waits() {
    const WORDS: [&str; 2] = ["queue.submit(", "device.poll("];
    let frame = root().join("crates/gpu/src/frame.rs");
    let files = sources(&root().join("crates"), "rs");
    let with: Vec<&PathBuf> =
        files.iter().filter(|(_, text)| !lines_with(text, &WORDS).is_empty()).map(|(path, _)| path).collect();
    assert_eq!(with, [&frame]);
}

#[test]
fn every_crate_forbids_unsafe_code() {
    let workspace = fs::read_to_string(root().join("Cargo.toml")).expect("the workspace's manifest");
    assert_eq!(setting(&workspace, "workspace.lints.rust", "unsafe_code"), Some("\"forbid\""));
    let packages = graph().workspace_packages();
    assert!(packages.len() >= ALLOWED.len());
    for package in packages {
        let manifest = fs::read_to_string(&package.manifest_path).expect("a manifest");
        assert_eq!(setting(&manifest, "lints", "workspace"), Some("true"), "{}", package.manifest_path);
    }
    assert_eq!(setting("[lints]\nworkspace = false\n", "lints", "workspace"), Some("false"));
    assert_eq!(setting("[package]\nname = \"x\"\n[lints.rust]\n", "lints", "workspace"), None);
}

/// A further camera model changes these files, and adds its own. "A camera model" in ARCHITECTURE.md lists them.
#[test]
fn camera_models_are_told_apart_in_few_files() {
    const PLACES: [&str; 6] = [
        "crates/depth-image/src/camera.rs",
        "crates/reconstruction/src/single_pole.rs",
        "crates/render/src/batch.rs",
        "crates/render/src/pixel_camera.rs",
        "crates/sampling/src/mirrors/single_poles.rs",
        "crates/wire/src/convert/geometry.rs",
    ];
    const PROGRAMS: [&str; 9] = [
        "client",
        "compositor-node",
        "coordinator",
        "crates",
        "gateway",
        "myriorama/src",
        "node-host",
        "sampler-node",
        "simulation",
    ];
    let is_test =
        |path: &Path| path.components().any(|part| part.as_os_str() == "tests" || part.as_os_str() == "scalar");
    let names = ["Camera::SinglePole", "Self::SinglePole("];
    let product = |text: &str| text.split("#[cfg(test)]").next().unwrap_or_default().to_owned();
    let files = PROGRAMS.into_iter().flat_map(|folder| sources(&root().join(folder), "rs"));
    let files = files.filter(|(path, _)| !is_test(path) && !path.to_string_lossy().ends_with("_tests.rs"));
    let mut found: Vec<PathBuf> =
        files.filter(|(_, text)| !lines_with(&product(text), &names).is_empty()).map(|(path, _)| path).collect();
    found.sort();
    assert_eq!(found, PLACES.map(|place| root().join(place)));
    let page = fs::read_to_string(root().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md");
    PLACES.iter().for_each(|place| assert!(page.contains(place), "ARCHITECTURE.md does not name {place}"));
}

/// Names of all methods.
fn methods() -> Vec<&'static str> {
    let methods =
        reconstruction::METHODS.iter().map(|row| row.name).chain(sampling::METHODS.iter().map(|row| row.name));
    // Drawn from the triangles: a policy, not a variant.
    methods.chain(["direct"]).collect()
}

#[test]
fn every_method_has_its_page() {
    const PARTS: [&str; 4] = ["## Source", "## Equations", "## Cost", "## Known failures"];
    let folder = root().join("docs/methods");
    assert!(methods().len() >= 9, "the tables were read");
    for name in methods() {
        let page = folder.join(format!("{name}.md"));
        let text = fs::read_to_string(&page).unwrap_or_else(|e| panic!("{}: {e}", page.display()));
        for part in PARTS {
            assert!(text.lines().any(|line| line == part), "{} lacks {part:?}", page.display());
        }
    }
    let links = fs::read_to_string(root().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md");
    for (page, _) in sources(&folder, "md") {
        let name = page.file_name().and_then(|n| n.to_str()).expect("a name").to_owned();
        assert!(links.contains(&format!("docs/methods/{name}")), "ARCHITECTURE.md does not mention {name}");
    }
}
