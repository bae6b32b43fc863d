//! `view` that is interrupted and resumed leaves the files of one that was not, by a real cluster.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};

/// `myriorama up`, which is killed at the end.
struct Up {
    process: Child,
    address: String,
}

impl Up {
    fn start() -> Self {
        let mut program = Command::new(env!("CARGO_BIN_EXE_myriorama"));
        program.args(["up", "--scene", "courtyard", "--nodes", "2", "--device", "software", "--listen", "127.0.0.1:0"]);
        let mut process = program.stdout(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(process.stdout.take().unwrap()).lines().map(Result::unwrap);
        let line = lines.into_iter().find(|line| line.contains("http://127.0.0.1:")).unwrap();
        let address = line[line.find("http://").unwrap()..].to_owned();
        Self { process, address }
    }

    fn view(&self, folder: &Path, arguments: &[&str]) -> Command {
        let mut program = Command::new(env!("CARGO_BIN_EXE_myriorama"));
        program.args(["view", "--coordinator", &self.address, "--policy", "pipeline", "--size", "48x36", "--out"]);
        program.arg(folder).args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
        program
    }

    /// Runs to the end, which is as expected.
    fn viewed(&self, folder: &Path, arguments: &[&str], status: i32) -> String {
        said(&self.view(folder, arguments).output().unwrap(), status)
    }
}

impl Drop for Up {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// What a program that ended as expected wrote to standard error.
fn said(output: &Output, status: i32) -> String {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(status), "{text}");
    text
}

fn files_of(folder: &Path) -> impl Iterator<Item = String> {
    fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap())
}

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(Result::unwrap);
    entries.map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap())).collect()
}

fn assert_equal(one: &Path, other: &Path) {
    let [one, other] = [one, other].map(files);
    let names = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&one), names(&other));
    one.iter().for_each(|(name, bytes)| assert!(bytes == &other[name], "{name} differs"));
}

/// The first lines of a record with `views` of its views.
fn cut(record: &Path, views: usize) {
    let text = fs::read_to_string(record).unwrap();
    let kept: Vec<&str> = text.lines().take(1 + views).collect();
    fs::write(record, format!("{}\n]}}\n", kept.join("\n").trim_end_matches(','))).unwrap();
}

/// Enough views that a command still makes them when it is interrupted.
const VIEWS: usize = 1200;
const MANY: &[&str] = &["--views", "1200"];

/// Waits until there is a picture.
fn wait_for_first_picture(folder: &Path) {
    while !folder.join("view_0000.png").exists() {
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// A pipe that nobody reads: what is written to this file waits.
fn block(file: &Path) {
    assert!(Command::new("mkfifo").arg(file).status().unwrap().success());
}

/// Sends a signal, which does not end the command, and another, which does.
fn interrupt_twice(mut view: Child) {
    kill_process(Pid::from_child(&view), Signal::INT).unwrap();
    std::thread::sleep(Duration::from_millis(500));
    assert!(view.try_wait().unwrap().is_none(), "it waits for a file");
    kill_process(Pid::from_child(&view), Signal::INT).unwrap();
    said(&view.wait_with_output().unwrap(), 130);
}

#[test]
fn a_second_signal_ends_a_command_that_writes_a_picture() {
    let up = Up::start();
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut view = up.view(folder, MANY).spawn().unwrap();
    wait_for_first_picture(folder);
    let part = folder.join("view_1199.part");
    block(&part);
    let pictures = || files_of(folder).filter(|name| name.ends_with(".png")).count();
    while pictures() < VIEWS - 1 {
        assert!(view.try_wait().unwrap().is_none(), "{} pictures", pictures());
        std::thread::sleep(Duration::from_millis(20));
    }
    interrupt_twice(view);
    assert_eq!((pictures(), part.exists()), (VIEWS - 1, false));
}

#[test]
fn a_second_signal_ends_a_command_that_writes_its_record() {
    let up = Up::start();
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let view = up.view(folder, MANY).spawn().unwrap();
    wait_for_first_picture(folder);
    let before = fs::read(folder.join("cameras.json")).unwrap();
    let part = folder.join("cameras.part");
    block(&part);
    interrupt_twice(view);
    assert_eq!(fs::read(folder.join("cameras.json")).unwrap(), before);
    assert!(!part.exists());
}

#[test]
fn a_resumed_request_leaves_the_files_of_one_that_was_not_interrupted() {
    const COMPARED: &[&str] = &["--views", "6", "--frames", "2", "--depth", "--provenance", "--compare"];
    let up = Up::start();
    let folders = [(); 4].map(|()| tempfile::tempdir().unwrap());
    let [whole, interrupted, compared, lost] = folders.each_ref().map(tempfile::TempDir::path);

    // A process that ends without a word leaves a record of some views, and parts.
    up.viewed(compared, COMPARED, 0);
    files(compared).iter().for_each(|(name, bytes)| fs::write(lost.join(name), bytes).unwrap());
    cut(&lost.join("cameras.json"), 7);
    for name in ["view_0001.depth.png", "view_0009.png", "comparison.csv"] {
        fs::remove_file(lost.join(name)).unwrap();
    }
    fs::write(lost.join("view_0010.part"), "half a picture").unwrap();
    up.viewed(lost, &[COMPARED, &["--resume"]].concat(), 0);
    assert_equal(compared, lost);

    let refused = up.viewed(lost, &[COMPARED, &["--resume", "--method", "mesh"]].concat(), 2);
    assert!(refused.contains("--resume") && refused.contains("this request of \"mesh\""), "{refused}");
    assert_equal(compared, lost);

    up.viewed(whole, MANY, 0);
    let view = up.view(interrupted, MANY).spawn().unwrap();
    wait_for_first_picture(interrupted);
    kill_process(Pid::from_child(&view), Signal::INT).unwrap();
    let text = said(&view.wait_with_output().unwrap(), 130);
    let left = files(interrupted);
    let pictures = left.keys().filter(|name| name.ends_with(".png")).count();
    assert_eq!(left.len(), pictures + 1, "whole pictures and the record: {:?}", left.keys());
    assert!(text.contains(&format!("{pictures} of {VIEWS} views are written to {}", interrupted.display())), "{text}");
    assert!(text.contains(&format!("--views {VIEWS} --resume` asks for the rest")), "{text}");
    assert!((1..VIEWS).contains(&pictures), "{pictures}");
    let record = String::from_utf8(left["cameras.json"].clone()).unwrap();
    assert_eq!(record.lines().count(), pictures + 2);
    up.viewed(interrupted, &[MANY, &["--resume"]].concat(), 0);
    assert_equal(whole, interrupted);
}
