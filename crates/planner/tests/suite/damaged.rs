//! Kept measurements as JSON, whole and damaged.

use planner::{
    Certificate, Command, Event, Kept, KeptCosts, KeptError, KeptKey, KeptRow, MAX_KEPT_BYTES, MAX_SCREENING_VIEWS,
    Purpose, RowCosts, ViewErrors,
};
use serde_json::Value;

use crate::made_up::{Subject, answer, key, plan, planner, request};
use crate::random::Random;

const DAMAGED: u64 = 2_000;

/// Measurements that a plan keeps.
fn kept() -> Kept {
    let subject = Subject::new(5).with_direct(1.0);
    let mut flip = subject.flip.clone();
    flip.sort_by(f64::total_cmp);
    plan(&subject, &format!("flip {:.5}", flip[70]), 5).kept()
}

#[test]
fn what_is_kept_is_read_back() {
    let kept = kept();
    assert!(kept.rows.len() > 20 && kept.rows.iter().any(|row| !row.certificates.is_empty()));
    assert!(kept.fresh_views_drawn > 0);
    let json = kept.to_json().unwrap();
    println!("{} rows in {} bytes", kept.rows.len(), json.len());
    assert_eq_read_back(&Kept::from_json(json.as_bytes(), &key()).unwrap(), &kept);
}

/// Asserts that values are equal, numbers to their last bit but one: that is how exactly JSON is read.
fn assert_eq_read_back<T: serde::Serialize>(read: &T, written: &T) {
    let [read, written] = [read, written].map(|value| serde_json::to_value(value).unwrap());
    assert!(is_read_back(&read, &written), "{read}, not {written}");
}

fn is_read_back(read: &Value, written: &Value) -> bool {
    match (read, written) {
        (Value::Array(read), Value::Array(written)) => {
            read.len() == written.len() && read.iter().zip(written).all(|(read, written)| is_read_back(read, written))
        }
        (Value::Object(read), Value::Object(written)) => {
            let is_of =
                |(name, value): (&String, &Value)| written.get(name).is_some_and(|own| is_read_back(value, own));
            read.len() == written.len() && read.iter().all(is_of)
        }
        (Value::Number(read), Value::Number(written)) => match (read.as_f64(), written.as_f64()) {
            (Some(read), Some(written)) => (read - written).abs() <= 2.0 * f64::EPSILON * written.abs(),
            _ => false,
        },
        _ => read == written,
    }
}

/// Bytes are changed, cut, doubled, or replaced by values that break limits.
fn damage(json: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = json.to_vec();
    let place = random.below(bytes.len());
    match random.below(6) {
        0 => bytes.truncate(place),
        1 => bytes[place] = random.next() as u8,
        2 => (0..20).for_each(|_| bytes[place] ^= 1 << random.below(8)),
        3 => drop(bytes.splice(place..place, json[..place].iter().copied())),
        4 => drop(bytes.splice(place..(place + random.below(200)).min(json.len()), [])),
        _ => {
            let values: [&[u8]; 6] = [b"1e999", b"-1", b"null", b"99999999999999999999", b"[[[[", b"\"\\ud800\""];
            drop(bytes.splice(place..place, values[random.below(6)].iter().copied()));
        }
    }
    bytes
}

/// Damage that leaves a valid text, such as another digit in a name, is no error; everything else is one.
#[test]
fn damaged_measurements_are_refused_without_a_panic() {
    let json = kept().to_json().unwrap().into_bytes();
    let mut random = Random(11);
    let mut refused = 0;
    for _ in 0..DAMAGED {
        match Kept::from_json(&damage(&json, &mut random), &key()) {
            Ok(read) => assert_eq!(read.validate(), Ok(())),
            Err(error) => {
                assert!(error.to_string().len() < 500, "{error}");
                refused += 1;
            }
        }
    }
    println!("{refused} of {DAMAGED} damaged texts were refused");
    assert!(refused * 10 >= DAMAGED * 8, "{refused}");
}

/// A change to any digit of an error shows in the sums.
#[test]
fn a_changed_error_is_seen() {
    let mut kept = kept();
    let row = kept.rows.iter_mut().find(|row| row.screening.len() == MAX_SCREENING_VIEWS).expect("a screened row");
    row.screening[3].flip += 1e-6;
    let json = kept.to_json().unwrap();
    let error = Kept::from_json(json.as_bytes(), &key()).unwrap_err();
    assert!(matches!(&error, KeptError::Invalid(invalid) if invalid.field == "sums"), "{error}");
}

#[test]
fn foreign_measurements_are_refused_by_field() {
    let json = kept().to_json().unwrap();
    let other = KeptKey { lighting: "other".to_owned(), ..key() };
    let error = Kept::from_json(json.as_bytes(), &other).unwrap_err();
    assert!(matches!(error, KeptError::Foreign { field: "lighting" }), "{error}");
    for foreign in ["", "{}", "[]", "null", "7", "\"flip\"", "{\"key\":{}}", "P6 16 16 255"] {
        let error = Kept::from_json(foreign.as_bytes(), &key()).unwrap_err();
        assert!(matches!(error, KeptError::Damaged(_)), "{foreign}: {error}");
    }
}

#[test]
fn huge_texts_are_refused_before_they_are_read() {
    let huge = vec![b' '; MAX_KEPT_BYTES + 1];
    assert!(matches!(Kept::from_json(&huge, &key()), Err(KeptError::TooLarge { bytes }) if bytes == huge.len()));
    // A list of a million rows within the limit ends at the 221st.
    let row = serde_json_row();
    let json =
        format!("{{\"key\":{},\"fresh_views_drawn\":0,\"rows\":[{}]}}", serde_json_key(), vec![row; 100_000].join(","));
    assert!(json.len() < MAX_KEPT_BYTES);
    let error = Kept::from_json(json.as_bytes(), &key()).unwrap_err().to_string();
    assert!(error.contains("at most 220 entries"), "{error}");
    let deep = "[".repeat(1 << 20);
    assert!(matches!(Kept::from_json(deep.as_bytes(), &key()), Err(KeptError::Damaged(_))));
}

/// One row as JSON, cut from the text of all.
fn serde_json_row() -> String {
    let json = Kept { rows: vec![KeptRow::new(row(), Vec::new())], ..Kept::empty(key()) }.to_json().unwrap();
    let start = json.find("\"rows\":[").expect("rows") + 8;
    json[start..json.find("],\"searches\"").expect("searches")].to_owned()
}

fn serde_json_key() -> String {
    let json = Kept::empty(key()).to_json().unwrap();
    json[json.find("{\"scene\"").expect("a key")..=json.find('}').expect("its end")].to_owned()
}

fn row() -> planner::Row {
    crate::made_up::ladder().rows()[0].clone()
}

/// A change to a row that makes it impossible.
type Change<'a> = &'a dyn Fn(&mut KeptRow);

/// Each value that no plan writes, by the field that refuses it.
#[test]
fn impossible_measurements_are_refused_by_field() {
    let certificate = Certificate {
        budget: "flip 0.05".parse().unwrap(),
        views: 64,
        skipped_views: 0,
        expected_ratio: 0.04,
        bound_ratio: 0.05,
        foreground_ratio: 0.5,
    };
    let costs = KeptCosts {
        device: "a".to_owned(),
        program_version: "1".to_owned(),
        is_settled: true,
        costs: RowCosts { sample_image_s: 1.0, load_set_s: 1.0, reconstruct_view_s: 1.0 },
    };
    let errors = |flip: f64| ViewErrors {
        foreground_ratio: 1.0,
        flip,
        flip_whole: 0.0,
        mean_square: 0.0,
        disoccluded_ratio: 0.0,
    };
    let with = |change: &dyn Fn(&mut KeptRow)| {
        let good = KeptRow::new(row(), vec![errors(0.1)]);
        let mut bad = KeptRow { certificates: vec![certificate.clone()], costs: vec![costs.clone()], ..good };
        change(&mut bad);
        Kept { rows: vec![bad], ..Kept::empty(key()) }.validate()
    };
    assert_eq!(with(&|_| ()), Ok(()));
    let cases: [(&str, Change); 12] = [
        ("side_ratio", &|row| row.row.side_ratio = f64::NAN),
        ("flip", &|row| row.screening[0].flip = 2.0),
        ("screening", &|row| *row = KeptRow::new(row.row.clone(), vec![errors(0.0); 33])),
        ("sums", &|row| row.sums[1] = f64::NAN),
        ("views", &|row| row.certificates[0].views = 0),
        ("skipped_views", &|row| row.certificates[0].skipped_views = usize::MAX),
        ("expected_ratio", &|row| row.certificates[0].expected_ratio = f64::NAN),
        ("bound_ratio", &|row| row.certificates[0].bound_ratio = 0.051),
        ("foreground_ratio", &|row| row.certificates[0].foreground_ratio = -1.0),
        ("device", &|row| row.costs[0].device = String::new()),
        ("load_set_s", &|row| row.costs[0].costs.load_set_s = -1.0),
        ("load_set_s", &|row| row.costs[0].costs.load_set_s = f64::MAX),
    ];
    for (field, change) in cases {
        assert_eq!(with(change).expect_err(field).field, field);
    }
    let drawn = Kept { fresh_views_drawn: u64::MAX, ..Kept::empty(key()) };
    assert_eq!(drawn.validate().unwrap_err().field, "fresh_views_drawn");
}

/// The greatest costs that answers may name, for every row: their means stay within the limit.
#[test]
fn costs_at_their_limit_are_read_back() {
    let subject = Subject::new(5).with_direct(1.0);
    let mut planner = planner(&subject, request("flip 0.03", 5));
    let mut next = Some(Event::Remembered(Kept::empty(key())));
    let mut kept = None;
    while let Some(event) = next.take() {
        let commands = planner.step(event);
        kept = commands
            .iter()
            .find_map(|command| if let Command::Keep(kept) = command { Some(kept.clone()) } else { None });
        next = commands.iter().find_map(|command| answer(&subject, command)).map(|mut event| {
            let most = RowCosts { sample_image_s: 1e6, load_set_s: 1e6, reconstruct_view_s: 1e6 };
            match &mut event {
                Event::Probed(probed) => probed.costs = most,
                Event::Timed(timed) => timed.rows.iter_mut().for_each(|(_, costs)| *costs = most),
                _ => (),
            }
            event
        });
    }
    let kept = kept.expect("kept measurements");
    assert!(kept.rows.iter().any(|row| row.costs[0].costs.load_set_s == 1e6));
    let json = kept.to_json().unwrap();
    assert_eq_read_back(&Kept::from_json(json.as_bytes(), &key()).unwrap(), &kept);
}

#[test]
fn events_are_read_back_from_a_log() {
    let subject = Subject::new(5);
    let run = plan(&subject, "flip 0.03", 5);
    assert!(!run.probed(Purpose::Screening).is_empty());
    for event in run.events {
        let text = serde_json::to_string(&event).unwrap();
        assert_eq_read_back(&serde_json::from_str::<Event>(&text).unwrap(), &event);
    }
}
