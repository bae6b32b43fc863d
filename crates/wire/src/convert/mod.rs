//! Messages to types of the domain and back. Numbers that stand for "none" on the wire become `None` here.

use std::num::NonZeroU32;

use cluster::{
    BudgetRequest, InvalidField, MeasuredCosts, NodeStatus, OfferSettings, SamplePlanes, SceneHash, at_most,
};
use codec::{InverseDepthRange, SampleSetId};
use depth_image::{Antialias, ExposureEv, PinholeCamera, ToneMapping, ViewPlanes};
use glam::UVec2;
use prost::bytes::Bytes;

use crate::error::WireError;
use crate::proto;
use crate::rpc::MAX_MESSAGE_BYTES;

/// A value that messages hold as a `P`: a message, the type of a field, or a tuple of those of several fields.
pub(crate) trait Convert<P>: Sized {
    /// # Errors
    /// For what the domain does not allow; names the field, or, in a message, the message's own.
    fn read(value: P, field: &'static str) -> Result<Self, WireError>;

    fn write(self) -> P;
}

/// The message in an optional field.
fn required<T>(value: Option<T>, field: &'static str) -> Result<T, InvalidField> {
    value.ok_or(InvalidField::Missing { field })
}

/// Applies a check; gives a closure's argument its type.
fn check<T, E>(value: T, check: impl FnOnce(T) -> Result<(), E>) -> Result<(), WireError>
where
    WireError: From<E>,
{
    Ok(check(value)?)
}

/// Both conversions of messages from one list: `Message = Type { fields that share a name; field: the message's }`. A field
/// of the type may take several of the message: `field: one | two`. Errors name the message's field, or what follows `as`.
/// `with` sets a field that the type has not. `first` checks or completes the message. `valid or Camera` validates the result,
/// whose refusal is an `InvalidField::Camera` of the message's own field; `then` checks the result further.
macro_rules! messages {
    ($($message:ident = $type:ident {
        $($same:ident $(as $same_name:literal)?),* $(; $($own:ident: $($wire:ident)|+ $(as $name:literal)?),+)?
    } $(, with $fixed:ident = $value:expr)? $(, first $first:expr)? $(, valid or $refusal:ident)? $(, then $then:expr)?;)+) => {$(
        #[allow(unused_mut, unused_parens, reason = "`first` may complete the message; one field is no tuple")]
        #[allow(unused_variables, reason = "only `valid` needs the message's own field")]
        impl super::Convert<crate::proto::$message> for $type {
            fn read(mut message: crate::proto::$message, field: &'static str) -> Result<Self, crate::error::WireError> {
                $(super::check(&mut message, $first)?;)?
                let value = Self {
                    $($($own: super::Convert::read(($(message.$wire),+), name!($($wire)|+ $($name)?))?,)+)?
                    $($same: super::Convert::read(message.$same, name!($same $($same_name)?))?,)*
                };
                $(value.validate().map_err(|source| cluster::InvalidField::$refusal { field, source })?;)?
                $(super::check(&value, $then)?;)?
                Ok(value)
            }

            fn write(self) -> crate::proto::$message {
                $($(let ($($wire),+) = super::Convert::write(self.$own);)+)?
                crate::proto::$message {
                    $($same: super::Convert::write(self.$same),)* $($($($wire,)+)+)? $($fixed: $value)?
                }
            }
        }

        nested!($message = $type);
    )+};
}

/// The name of a field in errors.
macro_rules! name {
    ($($field:ident)|+) => { stringify!($($field)|+) };
    ($($field:ident)|+ $name:literal) => { $name };
}

/// Messages that other messages must have.
macro_rules! nested {
    ($($message:ident = $type:ident),+) => {$(
        impl super::Convert<Option<crate::proto::$message>> for $type {
            fn read(
                message: Option<crate::proto::$message>,
                field: &'static str,
            ) -> Result<Self, crate::error::WireError> {
                super::Convert::read(super::required(message, field)?, field)
            }

            fn write(self) -> Option<crate::proto::$message> {
                Some(super::Convert::write(self))
            }
        }
    )+};
}

/// Enums whose variants are those of the message's enum of that name, without its zero, which may stand for one of them.
macro_rules! enums {
    ($($type:ident $(or $unspecified:ident)? { $($variant:ident),+ })+) => {$(
        impl super::Convert<i32> for $type {
            fn read(value: i32, field: &'static str) -> Result<Self, crate::error::WireError> {
                match crate::proto::$type::try_from(value) {
                    $(Ok(crate::proto::$type::$variant) => Ok(Self::$variant),)+
                    $(Ok(crate::proto::$type::Unspecified) => Ok(Self::$unspecified),)?
                    _ => Err(crate::error::WireError::UnknownEnum { field, value }),
                }
            }

            fn write(self) -> i32 {
                match self {
                    $(Self::$variant => crate::proto::$type::$variant.into(),)+
                }
            }
        }
    )+};
}

mod frames;
mod geometry;
mod illumination;
mod images;
mod members;
mod session;
mod workload;

/// Values that need no check.
macro_rules! plain {
    ($($type:ty as $wire:ty: $read:expr, $write:expr;)+) => {$(
        impl Convert<$wire> for $type {
            fn read(value: $wire, _: &'static str) -> Result<Self, WireError> {
                let read: fn($wire) -> Self = $read;
                Ok(read(value))
            }

            fn write(self) -> $wire {
                let write: fn(Self) -> $wire = $write;
                write(self)
            }
        }
    )+};
}

plain! {
    bool as bool: |value| value, |value| value;
    u32 as u32: |value| value, |value| value;
    u64 as u64: |value| value, |value| value;
    f32 as f32: |value| value, |value| value;
    f64 as f64: |value| value, |value| value;
    String as String: |value| value, |value| value;
    u64 as u32: u64::from, |index| index as u32;
    f64 as u64: |bytes| bytes as f64, |bytes| bytes.round() as u64;
    Option<NonZeroU32> as u32: NonZeroU32::new, |count| count.map_or(0, NonZeroU32::get);
    () as proto::ChangeSessionResponse: |_| (), |()| proto::ChangeSessionResponse {};
    () as proto::ReportWorkResponse: |_| (), |()| proto::ReportWorkResponse {};
    () as proto::ReportSamplerResponse: |_| (), |()| proto::ReportSamplerResponse {};
    () as proto::GetStatusRequest: |_| (), |()| proto::GetStatusRequest {};
}

/// Values whose absence is a zero, or an empty text or list.
macro_rules! absent_if_empty {
    ($($type:ty as $wire:ty),+) => {$(
        impl Convert<$wire> for Option<$type> {
            fn read(value: $wire, field: &'static str) -> Result<Self, WireError> {
                (value != <$wire>::default()).then(|| Convert::read(value, field)).transpose()
            }

            fn write(self) -> $wire {
                self.map(Convert::write).unwrap_or_default()
            }
        }
    )+};
}

absent_if_empty!(u32 as u32, f64 as f64, String as String, SceneHash as String);
absent_if_empty!(Vec<PinholeCamera> as Vec<proto::PinholeCamera>);

/// Types whose fields are the message's own.
macro_rules! flat {
    ($($type:ident { $($own:ident $(as $name:literal)?: $wire:ty),+ })+) => {$(
        impl Convert<($($wire),+)> for $type {
            fn read(($($own),+): ($($wire),+), _: &'static str) -> Result<Self, WireError> {
                Ok(Self { $($own: Convert::read($own, name!($own $($name)?))?),+ })
            }

            fn write(self) -> ($($wire),+) {
                ($(Convert::write(self.$own)),+)
            }
        }
    )+};
}

flat! {
    UVec2 { x: u32, y: u32 }
    ToneMapping { exposure as "exposure_ev": f32, curve as "tone_curve": i32 }
    SamplePlanes { normals: bool, corner_inverse_depths: bool, light: bool }
    InverseDepthRange { least_per_m: f32, greatest_per_m: f32 }
    SampleSetId { plan_epoch: u64, index: u32 }
    SampleSetId { plan_epoch: u64, index: u64 }
    NodeStatus { node_name: String, address: String, device_name: String, is_software: bool }
    OfferSettings { method: String, sampling: String, lighting: String }
    BudgetRequest { budget: String, names_method: bool }
    MeasuredCosts {
        sample_image_s: Option<f64>, direct_view_s: Option<f64>, reconstruct_view_s: Option<f64>,
        load_set_s: Option<f64>, encode_view_s: Option<f64>, transfer_bytes_per_s: Option<f64>, image_bytes: Option<u64>
    }
}

impl<P, D: Convert<P>> Convert<Vec<P>> for Vec<D> {
    fn read(values: Vec<P>, field: &'static str) -> Result<Self, WireError> {
        values.into_iter().map(|value| D::read(value, field)).collect()
    }

    fn write(self) -> Vec<P> {
        self.into_iter().map(D::write).collect()
    }
}

impl<P, D: Convert<P>> Convert<Option<P>> for Option<D> {
    fn read(value: Option<P>, field: &'static str) -> Result<Self, WireError> {
        value.map(|value| D::read(value, field)).transpose()
    }

    fn write(self) -> Option<P> {
        self.map(D::write)
    }
}

/// How colour is sampled and shown, then the planes beside it.
impl Convert<(u32, f32, i32, bool, bool)> for ViewPlanes {
    fn read(
        (count, exposure_ev, curve, inverse_depth, provenance): (u32, f32, i32, bool, bool),
        field: &'static str,
    ) -> Result<Self, WireError> {
        let antialias = Convert::read(count, field)?;
        Ok(Self { antialias, tone: Convert::read((exposure_ev, curve), field)?, inverse_depth, provenance })
    }

    fn write(self) -> (u32, f32, i32, bool, bool) {
        let Self { antialias, tone, inverse_depth, provenance } = self;
        let (exposure_ev, curve) = tone.write();
        (antialias.write(), exposure_ev, curve, inverse_depth, provenance)
    }
}

impl Convert<f32> for ExposureEv {
    fn read(ev: f32, field: &'static str) -> Result<Self, WireError> {
        Ok(Self::new(ev).map_err(|_| InvalidField::out_of_range(field, ev, "from -16 to 16"))?)
    }

    fn write(self) -> f32 {
        self.ev()
    }
}

/// Samples a pixel; none said is one.
impl Convert<u32> for Antialias {
    fn read(count: u32, _: &'static str) -> Result<Self, WireError> {
        let antialias = Self::of(count.max(1));
        antialias.ok_or_else(|| InvalidField::out_of_range("antialias_sample_count", count, "1, 2, 4, 8 or 16").into())
    }

    fn write(self) -> u32 {
        self.samples()
    }
}

impl Convert<Bytes> for Bytes {
    fn read(value: Bytes, field: &'static str) -> Result<Self, WireError> {
        at_most(value.len(), MAX_MESSAGE_BYTES, field)?;
        Ok(value)
    }

    fn write(self) -> Bytes {
        self
    }
}

impl Convert<String> for SceneHash {
    fn read(value: String, _: &'static str) -> Result<Self, WireError> {
        Ok(Self::try_from(value)?)
    }

    fn write(self) -> String {
        self.into()
    }
}
