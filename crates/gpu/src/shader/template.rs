//! WGSL templates: includes, loops over cameras written out, and switches, by `minijinja`.
//!
//! `{% include "color.wgsl" %}` takes text from this crate; the rest is Jinja as usual. Resources have a group and no
//! number (`@group(0) var<uniform> camera: Camera;`): they are bound by name.

use std::collections::HashMap;

use minijinja::{Environment, UndefinedBehavior, Value};

use crate::{error::ShaderError, table::TABLE_WIDTH_LOG2};

/// Shader texts by name.
pub struct Templates {
    environment: Environment<'static>,
}

impl Templates {
    /// The shared includes, and `own` templates as (name, text).
    ///
    /// # Errors
    /// When a text is not a template.
    pub fn new(own: &[(&'static str, &'static str)]) -> Result<Self, ShaderError> {
        let shared = [
            ("color.wgsl", include_str!("../wgsl/color.wgsl")),
            ("normal.wgsl", include_str!("../wgsl/normal.wgsl")),
            ("light.wgsl", include_str!("../wgsl/light.wgsl")),
            ("highlight.wgsl", include_str!("../wgsl/highlight.wgsl")),
            ("table.wgsl", include_str!("../wgsl/table.wgsl")),
        ];
        let mut environment = Environment::new();
        environment.set_undefined_behavior(UndefinedBehavior::Strict);
        environment.add_global("table_width_log2", TABLE_WIDTH_LOG2);
        for &(name, text) in shared.iter().chain(own) {
            environment
                .add_template(name, text)
                .map_err(|source| ShaderError::Template { name: name.to_owned(), source })?;
        }
        Ok(Self { environment })
    }

    /// Adds numbers that Rust shares with WGSL, as [`wgsl_constants!`](crate::wgsl_constants) lists them.
    #[must_use]
    pub fn with_constants(mut self, constants: impl IntoIterator<Item = (&'static str, String)>) -> Self {
        constants.into_iter().for_each(|(name, literal)| self.environment.add_global(name, literal));
        self
    }

    /// The WGSL of `name` with `context` filled in.
    ///
    /// # Errors
    /// When the template uses what the context lacks.
    pub fn render(&self, name: &str, context: Value) -> Result<String, ShaderError> {
        let render = || self.environment.get_template(name)?.render(context);
        let text = render().map_err(|source| ShaderError::Template { name: name.to_owned(), source })?;
        Ok(with_binding_numbers(&text))
    }
}

/// Adds `@binding` after each `@group`, numbered in the order of declaration within its group.
fn with_binding_numbers(text: &str) -> String {
    let mut parts = text.split("@group(");
    let mut wgsl = parts.next().unwrap_or_default().to_owned();
    let mut counts: HashMap<&str, u32> = HashMap::new();
    for part in parts {
        let (group, declaration) = part.split_once(')').unwrap_or((part, ""));
        let count = counts.entry(group).or_default();
        wgsl.push_str(&format!("@group({group}) @binding({count}){declaration}"));
        *count += 1;
    }
    wgsl
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bindings_are_numbered_within_their_group() {
        let text = "// Two groups.\n@group(0) var a: A;\n@group(1) var b: B;\n@group(0) var c: C;\n";
        let wgsl = "// Two groups.\n@group(0) @binding(0) var a: A;\n@group(1) @binding(0) var b: B;\n@group(0) @binding(1) var c: C;\n";
        assert_eq!(with_binding_numbers(text), wgsl);
        assert_eq!(with_binding_numbers("fn f() {}"), "fn f() {}");
    }
}
