//! The JSON of a file. What other loaders take and the `gltf` crate refuses is rewritten before the crate parses it: byte
//! order marks, whole numbers written as `24.0`, members that are `null`, scenes without nodes, animation channels without a
//! target node.

use std::fmt::Display;
use std::mem::take;

use gltf::json::{Index, Root, Scene as JsonScene, Value, deserialize};
use serde::de::DeserializeOwned;

use super::super::Warnings;
use crate::{Fault, Limits, at_most};

const BYTE_ORDER_MARK: &str = "\u{feff}";
/// Values of the JSON for each object of it that [`Limits`] admits.
const VALUES_AN_OBJECT: u64 = 16;

/// Parses the JSON. Its size is bounded before memory is allocated for the parsed form.
pub(super) fn parse(json: &[u8], limits: &Limits, warnings: &Warnings) -> Result<Root, Fault> {
    // Each object of the JSON, even `{}`, becomes a struct of some hundred bytes, and each value 32 bytes.
    let most_values = limits.json_objects.saturating_mul(VALUES_AN_OBJECT);
    for (what, sign, limit) in [("JSON objects", b'{', limits.json_objects), ("JSON values", b',', most_values)] {
        at_most(what, json.iter().filter(|&&byte| byte == sign).count() as u64, limit)?;
    }
    // Names in another encoding are no reason to refuse a model.
    let text = String::from_utf8_lossy(json);
    let text = text.trim_start_matches(BYTE_ORDER_MARK).trim_end_matches('\0');
    // The parser admits 128 levels, so that the recursion below ends.
    let mut value: Value = deserialize::from_str(text).map_err(|e| Fault::malformed("JSON", e.to_string()))?;
    check_version(&value)?;
    simplify(&mut value);
    complete(&mut value, warnings);
    deserialize::from_value(value).map_err(|e| Fault::malformed("JSON", e.to_string()))
}

/// Reads the JSON of an extension that the `gltf` crate leaves unparsed.
pub(super) fn parsed<T: DeserializeOwned>(value: &Value, element: impl Display) -> Result<T, Fault> {
    deserialize::from_value(value.clone()).map_err(|e| Fault::malformed(element, e.to_string()))
}

/// The number of the default scene, or else of the first.
pub(super) fn chosen_scene(root: &Root) -> Option<Index<JsonScene>> {
    root.scene.or((!root.scenes.is_empty()).then(|| Index::new(0)))
}

/// Refuses other versions than 2. In version 1, which some files do not state, lists are objects.
fn check_version(root: &Value) -> Result<(), Fault> {
    let version = root.get("asset").and_then(|asset| asset.get("version")).map(ToString::to_string).unwrap_or_default();
    let version = version.trim_matches('"');
    let has_objects = ["buffers", "meshes", "nodes"].iter().any(|name| root.get(name).is_some_and(Value::is_object));
    if version.starts_with('2') || version.is_empty() && !has_objects {
        return Ok(());
    }
    Err(other_version(if version.is_empty() { "1.0" } else { version }))
}

pub(super) fn other_version(version: &str) -> Fault {
    Fault::unsupported(
        "asset",
        format!("glTF version {version}; `npx gltf-pipeline -i IN -o OUT` converts version 1.0"),
    )
}

/// Writes whole numbers without a fraction, and drops members that are `null` or of applications.
fn simplify(value: &mut Value) {
    /// From here on, neighbouring whole numbers are one `f64`.
    const LARGEST_WHOLE: f64 = (1u64 << 53) as f64;
    match value {
        Value::Number(number) if number.is_f64() => {
            let whole = number.as_f64().filter(|float| float.fract() == 0.0 && float.abs() < LARGEST_WHOLE);
            if let Some(whole) = whole.filter(|whole| *whole != 0.0 || whole.is_sign_positive()) {
                *value = Value::from(whole as i64);
            }
        }
        Value::Array(items) => items.iter_mut().for_each(simplify),
        Value::Object(members) => {
            members.retain(|name, member| !member.is_null() && name != "extras");
            members.values_mut().for_each(simplify);
        }
        _ => {}
    }
}

/// Adds lists that may be empty, and drops channels that the `gltf` crate has no form for.
fn complete(root: &mut Value, warnings: &Warnings) {
    for scene in items_of(root, "scenes") {
        add_empty_list(scene, "nodes");
    }
    for mesh in items_of(root, "meshes") {
        add_empty_list(mesh, "primitives");
    }
    for (number, animation) in items_of(root, "animations").iter_mut().enumerate() {
        add_empty_list(animation, "channels");
        add_empty_list(animation, "samplers");
        let Some(Value::Array(channels)) = animation.get_mut("channels") else { continue };
        for channel in take(channels) {
            let target = channel.get("target");
            let has_node = target.is_some_and(|target| target.get("node").is_some());
            // KHR_animation_pointer moves anything, maybe beside a node.
            let is_pointer = target.and_then(|target| target.get("path")?.as_str()) == Some("pointer");
            let place = format_args!("animation {number}");
            if is_pointer {
                warnings.count("channels of KHR_animation_pointer are left out", place);
            } else if has_node {
                channels.push(channel);
            } else {
                warnings.count("channels without a target node are left out", place);
            }
        }
    }
}

fn items_of<'v>(root: &'v mut Value, name: &str) -> &'v mut [Value] {
    root.get_mut(name).and_then(Value::as_array_mut).map_or(&mut [], Vec::as_mut_slice)
}

fn add_empty_list(value: &mut Value, name: &str) {
    if let Value::Object(members) = value {
        members.entry(name).or_insert_with(|| Value::Array(Vec::new()));
    }
}
