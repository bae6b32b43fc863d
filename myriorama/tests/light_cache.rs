//! `light_cache` in clusters of several processes, from samples without covered pixels of given cameras: its pictures, and those of
//! nodes that sample alone or take over.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use app_core::camera_record::{self, NamedCamera};
use app_core::setup::SceneArgs;
use glam::UVec2;
use serde_json::Map;

const NODES: usize = 3;
/// Enough that a node still makes views when it is killed.
const VIEWS: usize = 400;

/// A coordinator and its nodes, which are killed at the end.
struct Cluster {
    processes: Vec<Child>,
    address: String,
}

fn program(arguments: &[&str]) -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_myriorama"));
    program.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    program
}

/// Writes the sample cameras that the program would choose for the scene.
fn write_cameras(path: &Path) {
    let setup = SceneArgs::new("courtyard".parse().unwrap()).load().unwrap();
    let named = setup.samples.into_iter().zip(0..);
    let cameras = named.map(|(camera, number)| NamedCamera {
        file_path: format!("{number}.png"),
        camera: camera.resized(UVec2::new(96, 72)),
        more: Map::new(),
    });
    camera_record::write(path, cameras.collect::<Vec<_>>(), setup.scene.source_space, Map::new()).unwrap();
}

impl Cluster {
    fn start(cameras: &Path, node_count: usize) -> Self {
        let scene =
            ["--scene", "courtyard", "--lighting", "soft 4, occlusion 4", "--sampling", "non_redundant:coverage"];
        let samples = ["--samples", cameras.to_str().unwrap()];
        let arguments = [&["coordinator", "--listen", "127.0.0.1:0"], &scene[..], &samples].concat();
        let mut coordinator = program(&arguments).spawn().unwrap();
        let mut lines = BufReader::new(coordinator.stdout.take().unwrap()).lines().map(Result::unwrap);
        let line = lines.find(|line| line.contains("http://127.0.0.1:")).unwrap();
        let address = line[line.find("http://").unwrap()..].split_whitespace().next().unwrap().to_owned();
        let node = |_| {
            let arguments = ["node", "--coordinator", &address, "--device", "software"];
            program(&arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
        };
        let nodes = (0..node_count).map(node);
        let processes = std::iter::once(coordinator).chain(nodes).collect();
        let cluster = Self { processes, address };
        while !cluster.has_nodes(node_count) {
            std::thread::sleep(Duration::from_millis(100));
        }
        cluster
    }

    fn has_nodes(&self, count: usize) -> bool {
        let status = program(&["status", "--coordinator", &self.address]).output().unwrap();
        String::from_utf8_lossy(&status.stdout).matches("node-").count() >= count
    }

    /// A request whose method is that of traced light. In time-share every node samples and makes views.
    fn view(&self, policy: &str, folder: &Path, arguments: &[&str]) -> Command {
        let mut view = program(&["view", "--coordinator", &self.address, "--policy", policy, "--size", "96x72"]);
        view.args(["--provenance", "--out"]).arg(folder).args(arguments);
        view
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        for process in &mut self.processes {
            let _ = process.kill();
            let _ = process.wait();
        }
    }
}

fn succeeded(output: &Output) -> String {
    let [out, error] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text).into_owned());
    assert!(output.status.success(), "{out}{error}");
    out
}

fn pictures(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut pictures: Vec<PathBuf> = entries.filter(|path| path.extension().is_some_and(|end| end == "png")).collect();
    pictures.sort();
    pictures
}

#[test]
fn pictures_look_like_direct_ones_and_outlive_a_killed_node() {
    let folders = [(); 5].map(|()| tempfile::tempdir().unwrap());
    let [compared, whole, disturbed, expensive, alone] = folders.each_ref().map(tempfile::TempDir::path);
    let cameras = compared.join("samples.json");
    write_cameras(&cameras);
    let mut cluster = Cluster::start(&cameras, NODES);
    let against_direct = ["--orbit", "4", "--compare", "--quality", "fine"];
    let text = succeeded(&cluster.view("time-share", compared, &against_direct).output().unwrap());
    assert!(text.contains("foreground PSNR"), "{text}");
    let rows = fs::read_to_string(compared.join("comparison.csv")).unwrap();
    let worst: Vec<&str> = rows.lines().last().unwrap().split(',').collect();
    assert!(worst[0] == "worst" && worst[4].parse::<f64>().unwrap() >= 36.0, "{rows}");

    let few = ["--views", "2", "--lighting", "soft 16, indirect 64"];
    let text = succeeded(&cluster.view("time-share", expensive, &few).output().unwrap());
    // Whatever was measured, all nodes sample.
    assert!(text.contains("time-share, asked for") && text.contains("each of 3 nodes samples"), "{text}");
    let one = Cluster::start(&cameras, 1);
    succeeded(&one.view("time-share", alone, &few).output().unwrap());
    drop(one);
    let [by_three, by_one] = [expensive, alone].map(pictures);
    assert_eq!((by_three.len(), by_one.len()), (4, 4), "colour and provenance");
    for (one, other) in by_one.iter().zip(&by_three) {
        assert!(fs::read(one).unwrap() == fs::read(other).unwrap(), "{} differs", other.display());
    }

    let count = VIEWS.to_string();
    let many = ["--views", &count];
    succeeded(&cluster.view("time-share", whole, &many).output().unwrap());
    let mut view = cluster.view("time-share", disturbed, &many).spawn().unwrap();
    while pictures(disturbed).is_empty() {
        std::thread::sleep(Duration::from_millis(2));
    }
    cluster.processes[NODES].kill().unwrap();
    assert!(view.try_wait().unwrap().is_none(), "all views were made before");
    succeeded(&view.wait_with_output().unwrap());
    let [whole, disturbed] = [whole, disturbed].map(pictures);
    assert_eq!((whole.len(), disturbed.len()), (2 * VIEWS, 2 * VIEWS), "colour and provenance");
    for (one, other) in whole.iter().zip(&disturbed) {
        assert!(fs::read(one).unwrap() == fs::read(other).unwrap(), "{} differs", other.display());
    }
}
