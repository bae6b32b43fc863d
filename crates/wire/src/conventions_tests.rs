//! The conventions of the protos, checked on the descriptor set: a versioned package, a request and a response for each
//! call, service names, enums with a zero, and units.

use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet};

/// Endings of the names of numbers; counts and indices are units, too.
const UNITS: [&str; 20] = [
    "_m", "_per_m", "_s", "_px", "_bytes", "_count", "_epoch", "_index", "_indices", "_id", "_number", "_numbers",
    "_version", "_crc32", "_unit", "_rgb", "_hz", "_rad", "_ratio", "_ev",
];
/// Their fields are components: the unit is in the name of the field that holds one.
const TUPLES: [&str; 3] = ["Vec2", "Vec3", "Quaternion"];

fn files() -> Vec<FileDescriptorProto> {
    let set = FileDescriptorSet::decode(&include_bytes!(concat!(env!("OUT_DIR"), "/descriptors.bin"))[..]).unwrap();
    assert!(set.file.len() >= 6);
    set.file
}

fn messages() -> Vec<DescriptorProto> {
    files().into_iter().flat_map(|file| file.message_type).collect()
}

fn needs_unit(field: &FieldDescriptorProto) -> bool {
    let tuple = TUPLES.iter().any(|tuple| field.type_name() == format!(".myriorama.v1.{tuple}"));
    tuple || !matches!(field.r#type(), Type::Bool | Type::String | Type::Bytes | Type::Message | Type::Enum)
}

#[test]
fn packages_are_versioned() {
    for file in files() {
        assert_eq!(file.package(), "myriorama.v1");
        assert!(file.name().starts_with("myriorama/v1/"), "{}", file.name());
    }
}

#[test]
fn numbers_have_units() {
    let mut compared = 0;
    for message in messages().iter().filter(|message| !TUPLES.contains(&message.name())) {
        for field in message.field.iter().filter(|field| needs_unit(field)) {
            assert!(UNITS.iter().any(|unit| field.name().ends_with(unit)), "{}.{}", message.name(), field.name());
            compared += 1;
        }
    }
    assert!(compared > 40, "{compared}");
}

#[test]
fn times_and_lengths_are_not_integers_and_counts_are() {
    for message in messages() {
        for field in &message.field {
            let fractional = matches!(field.r#type(), Type::Float | Type::Double);
            let whole = ["_count", "_bytes", "_epoch", "_index", "_indices", "_id", "_number", "_numbers", "_crc32"]
                .iter()
                .any(|unit| field.name().ends_with(unit));
            assert!(!(fractional && whole), "{}.{}", message.name(), field.name());
            let repeated_number = field.label() == Label::Repeated && needs_unit(field);
            assert!(
                !repeated_number || ["_indices", "_numbers"].iter().any(|unit| field.name().ends_with(unit)),
                "{}.{}",
                message.name(),
                field.name()
            );
        }
    }
}

#[test]
fn calls_have_their_own_messages() {
    let mut calls = 0;
    for service in files().iter().flat_map(|file| &file.service) {
        assert!(service.name().ends_with("Service"), "{}", service.name());
        for method in &service.method {
            assert_eq!(method.input_type(), format!(".myriorama.v1.{}Request", method.name()));
            assert_eq!(method.output_type(), format!(".myriorama.v1.{}Response", method.name()));
            calls += 1;
        }
    }
    assert_eq!(calls, 11);
}

#[test]
fn enums_are_prefixed_and_begin_unspecified() {
    let mut enums = 0;
    for kind in files().iter().flat_map(|file| &file.enum_type) {
        let words: String = kind
            .name()
            .chars()
            .flat_map(|c| if c.is_uppercase() { vec!['_', c] } else { vec![c.to_ascii_uppercase()] })
            .collect();
        let prefix = &words[1..];
        assert_eq!(kind.value[0].name(), format!("{prefix}_UNSPECIFIED"));
        assert_eq!(kind.value[0].number(), 0);
        assert!(kind.value.iter().all(|value| value.name().starts_with(prefix)));
        enums += 1;
    }
    assert_eq!(enums, 8);
}
