//! Clips: what moves which node, and when.

use std::collections::HashSet;

use glam::{Quat, Vec4};
use gltf::json::animation::{
    Animation as JsonAnimation, Channel as JsonChannel, Interpolation as Curve, Property as Path, Sampler,
};
use gltf::json::validation::Checked;

use super::Document;
use crate::validate::check_times;
use crate::{Channel, Clip, Fault, Interpolation, Property, at_most};

/// All clips of a file. `Channel::node` is the file's number of the node.
pub(super) fn read(document: &Document) -> Result<Vec<Clip>, Fault> {
    at_most("animations", document.root.animations.len() as u64, document.limits.attributes)?;
    let mut reader = ClipReader { document, keys_left: document.limits.keys };
    let animations = document.root.animations.iter().enumerate();
    animations.map(|(number, animation)| reader.clip(number, animation)).collect()
}

struct ClipReader<'a> {
    document: &'a Document<'a>,
    keys_left: u64,
}

impl ClipReader<'_> {
    fn clip(&mut self, number: usize, animation: &JsonAnimation) -> Result<Clip, Fault> {
        let name = animation.name.clone().unwrap_or_else(|| format!("animation {number}"));
        let mut channels = Vec::new();
        // A node's property has one channel.
        let mut moved = HashSet::new();
        for (place, json) in animation.channels.iter().enumerate() {
            let element = format!("animation {number}, channel {place}");
            let Some(channel) = self.channel(&animation.samplers, json, &element)? else {
                let warning = "channels that move morph targets, which keep their default weights";
                self.document.warnings.count(warning, format_args!("animation {number} ({name})"));
                continue;
            };
            if !moved.insert((channel.node, channel.property)) {
                return Err(Fault::malformed(element, "an earlier channel moves the same property"));
            }
            channels.push(channel);
        }
        Ok(Clip { name, channels })
    }

    /// `None` for the weights of morph targets.
    fn channel(&mut self, samplers: &[Sampler], json: &JsonChannel, element: &str) -> Result<Option<Channel>, Fault> {
        let document = self.document;
        let Some(property) = property(json, element)? else { return Ok(None) };
        let node = json.target.node;
        if document.root.get(node).is_none() {
            return Err(Fault::malformed(element, format!("node {} does not exist", node.value())));
        }
        let number = json.sampler.value();
        let sampler = samplers.get(number);
        let sampler = sampler.ok_or_else(|| Fault::malformed(element, format!("sampler {number} does not exist")))?;
        let Checked::Valid(curve) = sampler.interpolation else {
            return Err(Fault::malformed(format_args!("{element}, interpolation"), "unknown"));
        };
        let interpolation = match curve {
            Curve::Step => Interpolation::Step,
            Curve::Linear => Interpolation::Linear,
            Curve::CubicSpline => Interpolation::CubicSpline,
        };
        let input = format!("{element}, input");
        let keys = document.layout(sampler.input, &input)?.count;
        at_most(format_args!("{input}, keys"), keys, self.keys_left)?;
        self.keys_left -= keys;
        let times_s: Vec<f32> = document.floats::<1>(sampler.input, &input)?.into_iter().flatten().collect();
        check_times(&times_s).map_err(|why| Fault::malformed(input, why))?;
        let output = format!("{element}, output");
        let expected = times_s.len() as u64 * interpolation.values_a_key() as u64;
        let has = document.layout(sampler.output, &output)?.count;
        if has != expected {
            return Err(Fault::malformed(output, format!("{has} values where its keys need {expected}")));
        }
        let mut values: Vec<Vec4> = if property == Property::Rotation {
            document.floats::<4>(sampler.output, &output)?.into_iter().map(Vec4::from).collect()
        } else {
            let values = document.floats::<3>(sampler.output, &output)?;
            values.into_iter().map(|[x, y, z]| Vec4::new(x, y, z, 0.0)).collect()
        };
        if let Some(bad) = values.iter().position(|value| !value.is_finite()) {
            return Err(Fault::malformed(output, format!("value {bad} is not finite")));
        }
        if property == Property::Rotation {
            make_unit(&mut values, interpolation).map_err(|why| Fault::malformed(output, why))?;
        }
        Ok(Some(Channel { node: node.value() as u32, property, interpolation, times_s, values }))
    }
}

/// `None` for the weights of morph targets.
fn property(json: &JsonChannel, element: &str) -> Result<Option<Property>, Fault> {
    match json.target.path {
        Checked::Valid(Path::Translation) => Ok(Some(Property::Translation)),
        Checked::Valid(Path::Rotation) => Ok(Some(Property::Rotation)),
        Checked::Valid(Path::Scale) => Ok(Some(Property::Scale)),
        Checked::Valid(Path::MorphTargetWeights) => Ok(None),
        Checked::Invalid => Err(Fault::malformed(
            format_args!("{element}, target.path"),
            "neither translation, rotation, scale nor weights",
        )),
    }
}

/// Makes rotations unit: integers are rounded, and exporters are careless. Slopes stay.
fn make_unit(values: &mut [Vec4], interpolation: Interpolation) -> Result<(), String> {
    let stride = interpolation.values_a_key();
    for (number, value) in values.iter_mut().enumerate().skip(stride / 2).step_by(stride) {
        let length = value.length();
        if !(length > 1e-6 && length.is_finite()) {
            return Err(format!("value {number} is no rotation"));
        }
        *value = Quat::from_vec4(*value / length).into();
    }
    Ok(())
}
