//! Numbers as text, in the shortest form that reads back as the same number: JSON numbers may lose their last bit on
//! the way through a parser.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

pub(super) fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    value.to_string().serialize(serializer)
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
}

/// The same, where a number may be missing.
pub(super) mod option {
    use super::{Deserialize, Deserializer, Serialize, Serializer};
    use serde::de::Error as _;

    pub(in super::super) fn serialize<S: Serializer>(value: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
        value.map(|value| value.to_string()).serialize(serializer)
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
        let text = Option::<String>::deserialize(deserializer)?;
        text.map(|text| text.parse().map_err(D::Error::custom)).transpose()
    }
}

/// The same of several.
pub(super) mod array {
    use super::{Deserialize, Deserializer, Serialize, Serializer};
    use cluster::ROW_PARTS;
    use serde::de::Error as _;

    pub(in super::super) fn serialize<S: Serializer>(
        values: &[f64; ROW_PARTS],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        values.map(|value| value.to_string()).serialize(serializer)
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<[f64; ROW_PARTS], D::Error> {
        let mut values = [0.0; ROW_PARTS];
        for (value, text) in values.iter_mut().zip(<[String; ROW_PARTS]>::deserialize(deserializer)?) {
            *value = text.parse().map_err(D::Error::custom)?;
        }
        Ok(values)
    }
}
