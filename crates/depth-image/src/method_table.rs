//! Tables of methods that users and messages name: `NAME`, or `NAME:SETTING`.

/// One row of a table of methods; the first row of a table is the default.
#[derive(Debug, Clone, Copy)]
pub struct NamedMethod<M> {
    /// In snake case; a `-` in a user's text counts as `_`.
    pub name: &'static str,
    /// The method with its default setting.
    pub method: M,
    /// The setting that may follow the name and a colon.
    pub setting: Option<Setting<M>>,
    /// Description of the method, for `--help`.
    pub help: &'static str,
}

/// A method's setting as users spell it.
#[derive(Debug, Clone, Copy)]
pub struct Setting<M> {
    /// As in `--help`: a placeholder, and the values that it stands for in parentheses.
    pub form: &'static str,
    /// The method with this setting; `None` for a value that it does not take.
    pub parse: fn(&str) -> Option<M>,
}

impl<M> NamedMethod<M> {
    /// The texts that name this method: without and with a setting.
    fn forms(&self) -> impl Iterator<Item = String> {
        let with_setting = self.setting.as_ref().map(|setting| format!("{}:{}", self.name, setting.form));
        std::iter::once(self.name.to_owned()).chain(with_setting)
    }
}

/// The method that a text names.
#[must_use]
pub fn method_named<M: Copy>(table: &[NamedMethod<M>], text: &str) -> Option<M> {
    let (name, setting) = text.split_once(':').map_or((text, None), |(name, setting)| (name, Some(setting)));
    let name = name.replace('-', "_");
    let row = table.iter().find(|row| row.name == name)?;
    match setting {
        None => Some(row.method),
        Some(setting) => (row.setting?.parse)(setting),
    }
}

/// All texts that name a method, as an error lists them.
#[must_use]
pub fn method_forms<M>(table: &[NamedMethod<M>]) -> String {
    let forms: Vec<String> = table.iter().flat_map(NamedMethod::forms).collect();
    forms.split_last().map_or_else(String::new, |(last, others)| format!("{} or {last}", others.join(", ")))
}

/// All methods and what they do, as `--help` lists them.
#[must_use]
pub fn method_help<M>(table: &[NamedMethod<M>]) -> String {
    let rows = table.iter().map(|row| format!("{}: {}", row.forms().collect::<Vec<_>>().join(" or "), row.help));
    rows.collect::<Vec<_>>().join("; ")
}

/// Gives an enum of methods the texts of `METHODS` beside it: its default, its help, parsing with an error of its own, and
/// printing. The enum has a `setting`, the setting as users spell it; `None` where the name alone says it.
#[macro_export]
macro_rules! named_methods {
    ($method:ident, $unknown:ident, $kind:literal) => {
        impl Default for $method {
            fn default() -> Self {
                METHODS[0].method
            }
        }

        impl $method {
            /// The text of `--help` on all methods.
            #[must_use]
            pub fn help() -> String {
                $crate::method_help(&METHODS)
            }
        }

        /// The text names no method, or gives a setting that the method does not take.
        #[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
        #[error("unknown {kind} {0:?}, expected {forms}", kind = $kind, forms = $crate::method_forms(&METHODS))]
        pub struct $unknown(String);

        impl std::str::FromStr for $method {
            type Err = $unknown;
            fn from_str(text: &str) -> Result<Self, $unknown> {
                $crate::method_named(&METHODS, text).ok_or_else(|| $unknown(text.to_owned()))
            }
        }

        impl std::fmt::Display for $method {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                use std::mem::discriminant;
                let row = METHODS.iter().find(|row| discriminant(&row.method) == discriminant(self));
                f.write_str(row.map_or("", |row| row.name))?;
                self.setting().map_or(Ok(()), |setting| write!(f, ":{setting}"))
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    const METHODS: [NamedMethod<u32>; 2] = [
        NamedMethod { name: "count_twice", method: 2, setting: None, help: "counts twice" },
        NamedMethod {
            name: "count",
            method: 7,
            setting: Some(Setting { form: "N (0 to 9)", parse: |text| text.parse().ok().filter(|&n| n < 10) }),
            help: "counts",
        },
    ];

    #[test]
    fn names_and_settings_are_parsed() {
        let named = |text: &str| method_named(&METHODS, text);
        assert_eq!([named("count-twice"), named("count"), named("count:3")], [Some(2), Some(7), Some(3)]);
        for text in ["", "twice", "count_twice:1", "count_twice:", "count:", "count:10", "count:3:4"] {
            assert_eq!(named(text), None, "{text}");
        }
    }

    #[test]
    fn errors_and_help_list_every_form() {
        assert_eq!(method_forms(&METHODS), "count_twice, count or count:N (0 to 9)");
        assert_eq!(method_help(&METHODS), "count_twice: counts twice; count or count:N (0 to 9): counts");
    }
}
