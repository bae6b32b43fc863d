//! Camera files survive a round trip, and faults are named.

use app_core::camera_file::{CameraFault, MAX_FILE_BYTES, Placement, read};
use app_core::camera_record::{self, NamedCamera, write};
use depth_image::{PinholeCamera, SourceSpace};
use glam::{DVec3, UVec2, Vec2, Vec3};
use serde_json::{Map, Value, json};

const PLACEMENT: Placement =
    Placement { source_space: SourceSpace::moved(DVec3::ZERO), near_m: 0.01, size_px: UVec2::new(120, 80) };

fn camera(i: u8) -> PinholeCamera {
    let eye = Vec3::new(f32::from(i), 1.0, 3.0 - f32::from(i) * 0.2);
    let camera = PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::Y, 0.8, UVec2::new(200, 150));
    PinholeCamera { principal_px: Vec2::new(90.0 + f32::from(i), 70.0), ..camera }
}

fn close(a: &PinholeCamera, b: &PinholeCamera) -> bool {
    let turned = a.forward_in_world().distance(b.forward_in_world())
        + (a.world_from_camera * Vec3::Y).distance(b.world_from_camera * Vec3::Y);
    a.eye_in_world.distance(b.eye_in_world) < 1e-5
        && turned < 1e-5
        && a.focal_px == b.focal_px
        && a.principal_px == b.principal_px
        && a.size_px == b.size_px
}

#[test]
fn cameras_survive_a_round_trip_far_from_the_origin() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cameras.json");
    let far = SourceSpace::moved(DVec3::new(2_683_123.25, 408.5, -1_247_321.75));
    let small = SourceSpace { origin_in_source: DVec3::splat(3e-9), metres_per_unit: 2f64.powi(30) };
    for source_space in [SourceSpace::default(), far, small] {
        let named = |i| NamedCamera { file_path: format!("{i}.png"), camera: camera(i), more: Map::new() };
        let cameras: Vec<_> = (0..5).map(named).collect();
        write(&path, cameras.clone(), source_space, Map::new()).unwrap();
        let found = read(&path, Placement { source_space, ..PLACEMENT }).unwrap();
        assert_eq!(found.len(), 5);
        for (named, found) in cameras.iter().zip(&found) {
            assert!(close(&named.camera, found), "{named:?} {found:?}");
        }
    }
}

#[test]
fn a_record_is_read_line_by_line_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cameras.json");
    assert!(camera_record::read(&path, |_| ()).unwrap().is_none(), "there is none");
    let about = Map::from_iter([("settings".to_owned(), json!({"method": "mesh"}))]);
    let named = |i| NamedCamera { file_path: format!("{i}.png"), camera: camera(i), more: Map::new() };
    for count in [0, 1, 3] {
        write(&path, (0..count).map(named), SourceSpace::moved(DVec3::X), about.clone()).unwrap();
        let mut lines = Vec::new();
        let found = camera_record::read(&path, |line| lines.push(line.to_owned())).unwrap().unwrap();
        assert_eq!(found["settings"], about["settings"]);
        assert_eq!(lines, (0..count).map(|i| named(i).line(SourceSpace::moved(DVec3::X))).collect::<Vec<_>>());
    }
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(serde_json::from_str::<Value>(&text).unwrap()["frames"].as_array().unwrap().len() == 3, "it is JSON");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no part is left");
}

#[test]
fn a_record_that_was_changed_is_refused_by_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cameras.json");
    for (text, line) in
        [("", 1), ("{}", 1), ("{\n}\n", 1), ("{\"a\":1,\"frames\":[\n{},\n{}", 3), ("{\"a\":,\"frames\":[\n]}\n", 1)]
    {
        std::fs::write(&path, text).unwrap();
        let error = camera_record::read(&path, |_| ()).unwrap_err();
        assert_eq!(error.to_string(), format!("{}: line {line}: is not as `myriorama view` writes it", path.display()));
    }
}

fn frame() -> Value {
    json!({"w": 200, "h": 150, "fl_x": 180.0, "transform_matrix": [[1, 0, 0, 0.5], [0, 1, 0, 0.25], [0, 0, 1, 2], [0, 0, 0, 1]]})
}

fn error_of(text: &str) -> app_core::camera_file::CameraFileError {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.json");
    std::fs::write(&path, text).unwrap();
    let error = read(&path, PLACEMENT).unwrap_err();
    assert!(error.to_string().contains("bad.json"), "{error}");
    error
}

/// A second frame with another value of one field.
fn with(field: &str, value: Value) -> String {
    let mut bad = frame();
    bad[field] = value;
    json!({"camera_model": "OPENCV", "frames": [frame(), bad]}).to_string()
}

#[test]
fn shared_intrinsics_hold_for_all_frames() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shared.json");
    let pose = json!({"transform_matrix": frame()["transform_matrix"]});
    std::fs::write(
        &path,
        json!({"w": 64, "h": 48, "fl_x": 60, "fl_y": 61, "cx": 30, "frames": [pose, frame()]}).to_string(),
    )
    .unwrap();
    let found = read(&path, PLACEMENT).unwrap();
    assert_eq!(
        (found[0].size_px, found[0].focal_px, found[0].principal_px),
        (UVec2::new(64, 48), Vec2::new(60.0, 61.0), Vec2::new(30.0, 24.0))
    );
    assert_eq!((found[1].size_px, found[1].eye_in_world), (UVec2::new(200, 150), Vec3::new(0.5, 0.25, 2.0)));
}

/// What instant-ngp, COLMAP's converters and nerfstudio's viewer write.
#[test]
fn other_writers_cameras_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cameras.json");
    let rows = frame()["transform_matrix"].clone();
    let flat: Vec<Value> = rows.as_array().unwrap().iter().flat_map(|row| row.as_array().unwrap().clone()).collect();
    let nearly = json!([rows[0], rows[1], rows[2], [0, 0, 1e-9, 0.9999999]]);
    let right_angle = std::f64::consts::FRAC_PI_2;
    let files = [
        (json!({"camera_angle_x": right_angle, "frames": [{"transform_matrix": rows}]}), [120, 80], 60.0),
        (
            json!({"camera_angle_x": right_angle, "w": 64, "h": 48, "frames": [{"transform_matrix": nearly}]}),
            [64, 48],
            32.0,
        ),
        (json!({"w": 64, "h": 48, "fl_x": 60, "frames": [{"transform_matrix": flat}]}), [64, 48], 60.0),
        (
            json!({"w": 64, "h": 48, "fl_x": 60, "camera_model": "SIMPLE_RADIAL", "k1": 0, "is_fisheye": false,
                "frames": [{"transform_matrix": rows}]}),
            [64, 48],
            60.0,
        ),
        (
            json!({"camera_type": "perspective", "render_width": 320, "render_height": 240,
                "camera_path": [{"camera_to_world": flat, "fov": 90, "aspect": 1.333}]}),
            [320, 240],
            120.0,
        ),
    ];
    for (file, size_px, focal_px) in files {
        std::fs::write(&path, format!("\u{feff}{file}")).unwrap();
        let camera = read(&path, PLACEMENT).unwrap_or_else(|error| panic!("{error}: {file}"))[0];
        assert_eq!((camera.size_px, camera.eye_in_world), (size_px.into(), Vec3::new(0.5, 0.25, 2.0)), "{file}");
        assert!((camera.focal_px - Vec2::splat(focal_px)).abs().max_element() < 1e-3, "{file}: {}", camera.focal_px);
    }
}

#[test]
fn a_fault_is_told_once() {
    let error = anyhow::Error::from(error_of("{\"frames\": ["));
    assert_eq!(format!("{error:#}").matches("EOF").count(), 1, "{error:#}");
}

#[test]
fn bad_fields_are_named_with_their_frame() {
    let scaled = json!([[2, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]);
    let mirrored = json!([[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]);
    let bad = [
        ("w", json!(0)),
        ("h", json!(65_535)),
        ("w", json!(1.5)),
        ("fl_x", json!("wide")),
        ("fl_x", json!(null)),
        ("k1", json!(0.1)),
        ("p2", json!(-0.01)),
        ("camera_model", json!("OPENCV_FISHEYE")),
        ("is_fisheye", json!(true)),
        ("camera_type", json!("equirectangular")),
        ("transform_matrix", json!(null)),
        ("transform_matrix", json!([[1, 0, 0, 0]])),
        ("transform_matrix", json!([[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 1]])),
        ("transform_matrix", scaled),
        ("transform_matrix", mirrored),
    ];
    for (field, value) in bad {
        let error = error_of(&with(field, value));
        assert_eq!(error.place, format!("frame 1, {field}"), "{error}");
    }
    let error = error_of(&with("fl_x", json!(0.0)));
    assert!(matches!(error.kind, CameraFault::Camera(_)), "{error}");
}

#[test]
fn nan_and_infinity_as_python_writes_them_are_named() {
    for number in ["NaN", "Infinity", "-Infinity"] {
        let text = with("fl_x", json!("HERE")).replace("\"HERE\"", number);
        let error = error_of(&text);
        assert_eq!(error.place, "frame 1, fl_x");
        assert!(matches!(error.kind, CameraFault::NotFinite(_)), "{error}");
    }
}

#[test]
fn files_without_cameras_are_refused() {
    assert!(matches!(error_of("{ \"frames\": [").kind, CameraFault::Json(_)));
    for text in ["[]", "{}", "{\"frames\": []}", "{\"frames\": [3]}"] {
        assert!(matches!(error_of(text).kind, CameraFault::Missing), "{text}");
    }
    let large = " ".repeat(MAX_FILE_BYTES as usize + 1);
    assert!(matches!(error_of(&large).kind, CameraFault::TooLarge { .. }));
    let many = format!("{{\"frames\": [{}0]}}", "0,".repeat(70_000));
    assert!(matches!(error_of(&many).kind, CameraFault::TooLarge { .. }));
    let absent = read(std::path::Path::new("/nowhere/cameras.json"), PLACEMENT).unwrap_err();
    assert!(matches!(absent.kind, CameraFault::Io(_)), "{absent}");
}
