use glam::{DVec3, UVec2, Vec3};

use super::*;

fn camera(x_m: f32) -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(x_m, 0.1, 3.0), Vec3::ZERO, Vec3::Y, 0.7, UVec2::new(8, 6))
}

/// Two views of three moments.
fn record(folder: &Path, method: &str, cameras: [f32; 2]) -> Record {
    let settings = Map::from_iter([("codec".to_owned(), json!("lz4")), ("method".to_owned(), json!(method))]);
    let views = (cameras.map(camera).into(), 3);
    Record::new(folder, SourceSpace::moved(DVec3::new(0.1, 1e6, 0.0)), settings, views, ViewPlanes::WITH_DEPTH).unwrap()
}

fn write(record: &mut Record, number: u64) {
    for name in FileNames::of(number, ViewPlanes::WITH_DEPTH).all() {
        std::fs::write(record.folder.join(name), "a picture").unwrap();
    }
    record.add(number, 0.1 + number as f32);
}

fn missing(record: &Record) -> Vec<u64> {
    record.missing().map(|view| view.frame).collect()
}

#[test]
fn views_that_are_whole_are_kept_and_the_others_requested() {
    let folder = tempfile::tempdir().unwrap();
    let mut first = record(folder.path(), "mesh", [0.3, 0.4]);
    first.resume().unwrap();
    assert_eq!(missing(&first), [0, 1, 2, 3, 4, 5], "there is no record");
    [4, 0, 1, 3, 3].into_iter().for_each(|number| write(&mut first, number));
    first.save().unwrap();
    std::fs::remove_file(folder.path().join("view_0001.depth.png")).unwrap();
    let mut second = record(folder.path(), "mesh", [0.3, 0.4]);
    second.resume().unwrap();
    assert_eq!((missing(&second), second.count(), second.total()), (vec![1, 2, 5], 3, 6));
    second.missing().for_each(|view| assert_eq!(u64::from(view.set_index), view.frame / 2));
    let mut elsewhere = record(folder.path(), "mesh", [0.3, 0.5]);
    elsewhere.resume().unwrap();
    assert_eq!(missing(&elsewhere), [1, 2, 3, 5], "3 has another camera");
}

#[test]
fn a_record_resumed_and_finished_is_that_of_one_go() {
    let [whole, parts] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let mut at_once = record(whole.path(), "mesh", [0.3, 0.4]);
    (0..6).for_each(|number| write(&mut at_once, number));
    at_once.save().unwrap();
    for numbers in [vec![5, 2], vec![0], vec![]] {
        let mut part = record(parts.path(), "mesh", [0.3, 0.4]);
        part.resume().unwrap();
        let rest = if numbers.is_empty() { missing(&part) } else { numbers };
        rest.into_iter().for_each(|number| write(&mut part, number));
        part.save().unwrap();
    }
    let text = |folder: &Path| std::fs::read_to_string(folder.join(FILE_NAME)).unwrap();
    assert_eq!(text(whole.path()), text(parts.path()));
    assert_eq!(text(whole.path()).lines().count(), 8);
}

#[test]
fn pictures_of_an_earlier_request_are_deleted_and_no_others() {
    let folder = tempfile::tempdir().unwrap();
    let mut earlier = record(folder.path(), "mesh", [0.3, 0.4]);
    (0..4).for_each(|number| write(&mut earlier, number));
    earlier.save().unwrap();
    let others = ["view_0009.png", "notes.txt"].map(|name| folder.path().join(name));
    others.iter().for_each(|path| std::fs::write(path, "kept").unwrap());
    assert_eq!(record(folder.path(), "direct", [0.1, 0.2]).delete_earlier(), 4, "views");
    let mut left: Vec<_> = folder.path().read_dir().unwrap().map(|entry| entry.unwrap().file_name()).collect();
    left.sort();
    assert_eq!(left, ["cameras.json", "notes.txt", "view_0009.png"]);
    std::fs::write(folder.path().join(FILE_NAME), "{}").unwrap();
    assert_eq!(record(folder.path(), "direct", [0.1, 0.2]).delete_earlier(), 0, "a record of another program");
}

#[test]
fn other_settings_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path(), "mesh", [0.3, 0.4]).save().unwrap();
    let error = record(folder.path(), "hybrid_mesh", [0.3, 0.4]).resume().unwrap_err();
    assert!(error.to_string().ends_with("is of method \"mesh\", this request of \"hybrid_mesh\""), "{error}");
    assert!(error.is::<BadInput>());
}

#[test]
fn the_record_is_written_now_and_then() {
    let folder = tempfile::tempdir().unwrap();
    let mut record = record(folder.path(), "mesh", [0.3, 0.4]);
    record.save_if_due().unwrap();
    assert!(!folder.path().join(FILE_NAME).exists(), "it is too early");
    record.next_save = Instant::now();
    record.save_if_due().unwrap();
    assert!(folder.path().join(FILE_NAME).exists() && record.next_save > Instant::now());
}

#[test]
fn more_views_than_a_record_has_room_for_are_refused() {
    let views = ([0.3, 0.4].map(camera).into(), 1 << 22);
    let refused =
        Record::new(Path::new("out"), SourceSpace::default(), Map::new(), views, ViewPlanes::WITH_DEPTH).err().unwrap();
    assert!(refused.to_string().contains("8388608 pictures"), "{refused}");
}
