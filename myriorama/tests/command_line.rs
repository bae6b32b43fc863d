//! The command line: help, exit status, messages.
#![allow(clippy::unwrap_used)]

use std::process::{Command, Output};

fn myriorama(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_myriorama")).args(arguments).output().unwrap()
}

fn status_and_message(output: &Output) -> (Option<i32>, String) {
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn help_teaches_every_command() {
    let help = myriorama(&["--help"]);
    let text = String::from_utf8_lossy(&help.stdout).into_owned();
    assert!(help.status.success());
    for command in ["demo", "up", "coordinator", "node", "view", "plan", "status", "health", "replay"] {
        assert!(text.contains(&format!("\n  {command} ")), "{command} in {text}");
        assert!(myriorama(&[command, "--help"]).status.success(), "{command} --help");
    }
    assert!(text.contains("Examples:") && text.contains("Exit status:"));
    assert!(String::from_utf8_lossy(&myriorama(&["--version"]).stdout).starts_with("myriorama "));
}

#[test]
fn input_that_cannot_be_used_is_named_with_status_2() {
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("broken.glb");
    std::fs::write(&broken, b"no model").unwrap();
    let cameras = folder.path().join("cameras.json");
    std::fs::write(&cameras, b"{\"frames\": [{}]}").unwrap();
    let broken = broken.to_str().unwrap();
    let cameras = cameras.to_str().unwrap();
    let folder = folder.path().to_str().unwrap();
    let many = vec!["flip 0.1"; 200].join(", ");
    let cases: [(&[&str], &str); 26] = [
        (&["plan", "--scene", "courtyard"], "--budget"),
        (&["plan", "--scene", "courtyard", "--budget", "blur 3"], "blur"),
        (&["plan", "--scene", "courtyard", "--budget", "flip NaN"], "flip NaN"),
        (&["plan", "--scene", "courtyard", "--budget", "flip 0"], "above 0"),
        (&["plan", "--scene", "courtyard", "--budget", &many], "two limits"),
        (
            &["plan", "--scene", "courtyard", "--budget", "flip 0.1", "--method", "mesh"],
            "none can be kept with --method",
        ),
        (&["view", "--budget", "flip 0.1", "--method", "mesh"], "cannot be used with"),
        (&["plan", "--scene", "courtyard", "--budget", "flip 0.1", "--views", "0"], "--views"),
        (&["plan", "--scene", broken, "--budget", "flip 0.1"], "broken.glb"),
        (&["up", "--scene", broken], "broken.glb"),
        (&["demo", "--scene", "/nowhere/absent.glb"], "absent.glb"),
        (&["coordinator", "--scene", broken], "broken.glb"),
        (&["coordinator", "--scene", "courtyard", "--scene", "courtyard"], "scene courtyard is given twice"),
        (&["view", "--cameras", cameras, "--out", folder], "would be written over it"),
        (&["up", "--scene", "courtyard", "--samples", cameras], "cameras.json: frame 0, fl_x"),
        (&["up", "--scene", "courtyard", "--listen", "0.0.0.0:0"], "--insecure-bind"),
        (&["up", "--scene", "courtyard", "--method", "guess"], "guess"),
        (&["view", "--size", "0x0"], "0x0"),
        (&["view", "--exposure", "nan"], "exposure must be auto, or from -16 to 16 EV"),
        (&["view", "--exposure", "99"], "exposure must be auto, or from -16 to 16 EV"),
        (&["view", "--tone-map", "foo"], "tone map must be none or khronos-neutral"),
        (&["up", "--scene", "courtyard", "--exposure", "-17"], "--exposure"),
        (&["view", "--orbit", "3", "--grid", "2x2"], "--grid"),
        (&["view", "--quality", "good"], "draft, fast, balanced, fine, exact"),
        (
            &["view", "--quality", "fine", "--method", "mesh"],
            "'--quality <NAME>' cannot be used with '--method <NAME>'",
        ),
        (&["up", "--scene", "courtyard", "--quality", "fine", "--method", "mesh"], "'--quality <NAME>' cannot be used"),
    ];
    for (arguments, named) in cases {
        let (status, message) = status_and_message(&myriorama(arguments));
        assert_eq!(status, Some(2), "{arguments:?}: {message}");
        assert!(message.contains(named), "{arguments:?}: {message}");
    }
}

#[test]
fn the_demo_writes_a_page_whose_checks_hold() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let demo = myriorama(&["demo", "--scene", "courtyard", "--quick", "--strict", "--out", out]);
    let (status, message) = status_and_message(&demo);
    assert_eq!(status, Some(0), "{message}");
    for file in ["first-page.png", "index.html", "report.json", "what-sharing-gains.csv", "pictures/first-page.png"] {
        assert!(folder.path().join(file).is_file(), "{file} is missing");
    }
    let gains = std::fs::read_to_string(folder.path().join("what-sharing-gains.csv")).unwrap();
    let rows: Vec<_> = gains.lines().skip(1).map(|row| row.split(',').collect::<Vec<_>>()).collect();
    assert_eq!(rows.len(), 2, "expensive and plain light: {gains}");
    for row in rows {
        // The light, "soft 16, occlusion 16", has a comma.
        let foreground_psnr_db: f64 = row[row.len() - 3].parse().unwrap();
        assert!(foreground_psnr_db > 20.0, "{gains}");
    }
}

#[test]
fn what_cannot_be_sampled_in_blocks_is_named_with_status_2() {
    let cases: [(&[&str], &str); 6] = [
        (&["up", "--scene", "courtyard", "--blocks", "0x3"], "--blocks"),
        (&["up", "--scene", "courtyard", "--blocks", "9x3"], "from 1 to 8"),
        (&["up", "--scene", "courtyard", "--blocks", "2x2", "--method", "mesh"], "--blocks 2x2: mesh follows no rays"),
        (
            &["up", "--scene", "courtyard", "--blocks", "2x2", "--sampling", "layered_cube:64"],
            "--blocks 2x2: layered_cube:64 takes no images",
        ),
        (&["up", "--scene", "courtyard", "--blocks", "2x2", "--budget", "flip 0.1"], "none can be kept with --blocks"),
        (&["demo", "--scene", "courtyard", "--blocks", "2x2"], "--blocks: this command takes none"),
    ];
    for (arguments, named) in cases {
        let (status, message) = status_and_message(&myriorama(arguments));
        assert_eq!(status, Some(2), "{arguments:?}: {message}");
        assert!(message.contains(named), "{arguments:?}: {message}");
    }
}

#[test]
fn what_cannot_be_sampled_as_a_cube_is_named_with_status_2() {
    let fields = "layered_cube:64+light_field:66";
    let cases: [(&[&str], &str); 17] = [
        (&["up", "--scene", "snake", "--base", "layered_cube:64"], "--base layered_cube:64: snake moves"),
        (&["up", "--scene", "courtyard", "--base", "conventional"], "--base conventional: a base is a layered cube"),
        (
            &["up", "--scene", "courtyard", "--sampling", "layered_cube:64", "--base", "layered_cube:64"],
            "a cube already",
        ),
        (
            &["demo", "--scene", "courtyard", "--base", "layered_cube:64"],
            "--base layered_cube:64: this command takes none",
        ),
        (&["up", "--scene", "snake", "--sampling", "layered_cube:64"], "snake moves"),
        (&["up", "--scene", "courtyard", "--sampling", "layered_cube:15"], "layered_cube:15"),
        (&["up", "--scene", "courtyard", "--sampling", "layered_cube:64", "--method", "mesh"], "--method mesh"),
        (&["up", "--scene", "courtyard", "--method", "layered"], "see --sampling"),
        (&["up", "--scene", "courtyard", "--sampling", "layered_cube:64", "--sample-size", "40x30"], "--sample-size"),
        (
            &["plan", "--scene", "courtyard", "--sampling", "layered_cube:64", "--budget", "flip 0.1"],
            "none can be kept with a layered cube",
        ),
        (
            &["up", "--scene", "courtyard", "--sampling", "layered_cube:64+light_field:100"],
            "layered_cube:64+light_field:100",
        ),
        (
            &["up", "--scene", "courtyard", "--sampling", fields, "--lighting", "shadows"],
            "--lighting with reflections N",
        ),
        (&["up", "--scene", "courtyard", "--sampling", "layered_cube:64", "--method", "layered:0"], "in a light field"),
        (
            &["up", "--scene", "courtyard", "--base", "layered_cube:64", "--budget", "flip 0.1"],
            "--budget flip 0.1: none can be kept with --base",
        ),
        (
            &["coordinator", "--scene", "courtyard", "--base", "layered_cube:64", "--budget", "flip 0.1"],
            "--budget flip 0.1: none can be kept with --base",
        ),
        (
            &["up", "--scene", "courtyard", "--sampling", "layered_cube:64", "--budget", "flip 0.1"],
            "--budget flip 0.1: none can be kept with a layered cube",
        ),
        (&["up", "--scene", "courtyard", "--base", fields], "--base layered_cube:64+light_field:66: a light field"),
    ];
    for (arguments, named) in cases {
        let (status, message) = status_and_message(&myriorama(arguments));
        assert_eq!(status, Some(2), "{arguments:?}: {message}");
        assert!(message.contains(named), "{arguments:?}: {message}");
    }
}

#[test]
fn an_absent_cluster_is_a_failure_at_run_time() {
    let (status, message) =
        status_and_message(&myriorama(&["view", "--coordinator", "http://127.0.0.1:9", "--orbit", "2"]));
    assert_eq!(status, Some(3), "{message}");
    assert!(message.contains("127.0.0.1:9"), "{message}");
}
