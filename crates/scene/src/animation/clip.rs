//! Motion over time: keys, and values between them (glTF 2.0, 3.11 and appendix C).

use glam::{Quat, Vec4};
use serde::{Deserialize, Serialize};

/// A motion of nodes that repeats.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Clip {
    /// Name in the source, or its number.
    pub name: String,
    /// Every node's property has one channel at most; of several, the last counts.
    pub channels: Vec<Channel>,
}

/// One property of one node over time. Before the first key and after the last one, the property has that key's value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Channel {
    /// Index into [`Animation::nodes`](super::Animation::nodes), of a node that is given by its parts.
    pub node: u32,
    /// The property that the values are of.
    pub property: Property,
    /// The curve between keys.
    pub interpolation: Interpolation,
    /// Times of the keys, seconds: at least one, from 0 on, none less than the one before.
    pub times_s: Vec<f32>,
    /// A value for each key; three for a cubic spline: slope before the key, value, slope after it (a second).
    /// Translation (metres) and scale have x, y and z, rotation is a unit quaternion x, y, z, w.
    pub values: Vec<Vec4>,
}

/// What a channel moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[allow(missing_docs, reason = "self-naming variants")]
pub enum Property {
    Translation,
    Rotation,
    Scale,
}

/// The curve between two keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Interpolation {
    /// The value of the key before.
    Step,
    /// A straight line; for rotations the shortest arc, at constant speed.
    Linear,
    /// A Hermite curve through values and slopes; for rotations made unit afterwards.
    CubicSpline,
}

impl Interpolation {
    /// Values of a channel for each of its keys.
    #[must_use]
    pub fn values_a_key(self) -> usize {
        if self == Self::CubicSpline { 3 } else { 1 }
    }
}

impl Clip {
    /// The time after which the clip begins anew, seconds: that of its last key.
    #[must_use]
    pub fn duration_s(&self) -> f32 {
        self.channels.iter().filter_map(|channel| channel.times_s.last()).fold(0.0, |most, &time| most.max(time))
    }

    /// The clip's own time at a scene time, seconds.
    #[must_use]
    pub fn time_s(&self, scene_time_s: f32) -> f32 {
        let duration_s = self.duration_s();
        if duration_s > 0.0 { scene_time_s.rem_euclid(duration_s) } else { 0.0 }
    }
}

impl Channel {
    /// The property's value at a time of the clip. A channel without keys has the value 0.
    #[must_use]
    pub fn value_at(&self, clip_time_s: f32) -> Vec4 {
        let next = self.times_s.partition_point(|&key_s| key_s <= clip_time_s);
        let (Some(key), Some(&next_s)) = (next.checked_sub(1), self.times_s.get(next)) else {
            return self.value(next.saturating_sub(1));
        };
        // The key before is the last at or before the time, and the next is later: the span is positive.
        let span_s = next_s - self.times_s[key];
        let share = (clip_time_s - self.times_s[key]) / span_s;
        match self.interpolation {
            Interpolation::Step => self.value(key),
            Interpolation::Linear if self.property == Property::Rotation => {
                Quat::from_vec4(self.value(key)).slerp(Quat::from_vec4(self.value(next)), share).into()
            }
            Interpolation::Linear => self.value(key).lerp(self.value(next), share),
            Interpolation::CubicSpline => self.on_spline(key, span_s, share),
        }
    }

    /// The value of a key, without slopes.
    fn value(&self, key: usize) -> Vec4 {
        let stride = self.interpolation.values_a_key();
        self.stored(key * stride + stride / 2)
    }

    fn stored(&self, index: usize) -> Vec4 {
        self.values.get(index).copied().unwrap_or(Vec4::ZERO)
    }

    /// The cubic Hermite spline of glTF 2.0, appendix C.
    fn on_spline(&self, key: usize, span_s: f32, share: f32) -> Vec4 {
        let slope_after = self.stored(key * 3 + 2);
        let slope_before_next = self.stored((key + 1) * 3);
        let square = share * share;
        let cube = share * share * share;
        self.value(key) * (2.0 * cube - 3.0 * square + 1.0)
            + slope_after * (span_s * (cube - 2.0 * square + share))
            + self.value(key + 1) * (3.0 * square - 2.0 * cube)
            + slope_before_next * (span_s * (cube - square))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(property: Property, interpolation: Interpolation, times_s: &[f32], values: &[Vec4]) -> Channel {
        Channel { node: 0, property, interpolation, times_s: times_s.to_vec(), values: values.to_vec() }
    }

    #[test]
    fn steps_hold_and_lines_go_straight() {
        let values = [Vec4::ZERO, Vec4::new(2.0, 4.0, 0.0, 0.0), Vec4::ONE];
        let of = |curve| channel(Property::Translation, curve, &[1.0, 3.0, 4.0], &values);
        let step = of(Interpolation::Step);
        let line = of(Interpolation::Linear);
        for (time_s, on_step, on_line) in [
            (0.0, values[0], values[0]),
            (1.0, values[0], values[0]),
            (2.0, values[0], Vec4::new(1.0, 2.0, 0.0, 0.0)),
            (3.0, values[1], values[1]),
            (4.0, values[2], values[2]),
            (9.0, values[2], values[2]),
        ] {
            assert_eq!((step.value_at(time_s), line.value_at(time_s)), (on_step, on_line), "{time_s} s");
        }
    }

    #[test]
    fn a_jump_of_two_keys_at_one_time_has_no_way_between() {
        let values = [0.0, 1.0, 5.0, 6.0].map(Vec4::splat);
        let jump = channel(Property::Scale, Interpolation::Linear, &[0.0, 1.0, 1.0, 2.0], &values);
        assert!(jump.value_at(1f32.next_down()).x < 1.001);
        assert_eq!((jump.value_at(1.0), jump.value_at(1.5)), (values[2], Vec4::splat(5.5)));
    }

    #[test]
    fn rotations_turn_at_constant_speed_on_the_shorter_arc() {
        let quarter = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
        // The same rotation with the other sign.
        let values = [Quat::IDENTITY.into(), Vec4::from(-quarter)];
        let turning = channel(Property::Rotation, Interpolation::Linear, &[0.0, 1.0], &values);
        for tenth in 0..=10 {
            let share = tenth as f32 * 0.1;
            let expected = Quat::from_rotation_z(share * std::f32::consts::FRAC_PI_2);
            let found = Quat::from_vec4(turning.value_at(share));
            assert!(found.dot(expected).abs() > 1.0 - 1e-6, "{share}: {found}");
        }
    }

    /// A cubic is its own Hermite spline.
    #[test]
    fn splines_follow_a_cubic_exactly() {
        let position = |t: f32| t * t * t - 2.0 * t + 1.0;
        let slope = |t: f32| 3.0 * t * t - 2.0;
        let times_s = [0.5, 1.25, 3.0];
        let values: Vec<Vec4> =
            times_s.iter().flat_map(|&t| [slope(t), position(t), slope(t)]).map(Vec4::splat).collect();
        let spline = channel(Property::Translation, Interpolation::CubicSpline, &times_s, &values);
        for step in 0..=50 {
            let time_s = 0.5 + 2.5 * step as f32 / 50.0;
            let found = spline.value_at(time_s).x;
            let expected = position(time_s);
            assert!((found - expected).abs() < 1e-4 * expected.abs().max(1.0), "{time_s}: {found}, not {expected}");
        }
    }

    #[test]
    fn a_clip_begins_anew_after_its_last_key() {
        let values = [Vec4::ZERO, Vec4::ONE];
        let late = channel(Property::Scale, Interpolation::Linear, &[1.0, 2.5], &values);
        let clip = Clip { name: "late".into(), channels: vec![late] };
        assert_eq!(clip.duration_s(), 2.5);
        assert_eq!([0.5, 2.0, 3.0, 7.75, -0.5].map(|t| clip.time_s(t)), [0.5, 2.0, 0.5, 0.25, 2.0]);
        assert_eq!(Clip::default().time_s(3.0), 0.0);
    }
}
