//! WGSL templates: includes, loops over cameras written out, and switches, by `minijinja`.
//!
//! `{% include "color.wgsl" %}` takes text from this crate; the rest is Jinja as usual.

use minijinja::{Environment, UndefinedBehavior, Value};

/// Shader texts by name.
pub struct Templates {
    environment: Environment<'static>,
}

/// A template that cannot be written out.
#[derive(Debug, thiserror::Error)]
#[error("shader template {name}: {source}")]
pub struct TemplateError {
    /// Which.
    name: String,
    /// Why.
    source: minijinja::Error,
}

impl Templates {
    /// The shared includes, and `own` templates as (name, text).
    ///
    /// # Errors
    /// When a text is not a template.
    pub fn new(own: &[(&'static str, &'static str)]) -> Result<Self, TemplateError> {
        let shared = [
            ("color.wgsl", include_str!("wgsl/color.wgsl")),
            ("normal.wgsl", include_str!("wgsl/normal.wgsl")),
            ("light.wgsl", include_str!("wgsl/light.wgsl")),
            ("highlight.wgsl", include_str!("wgsl/highlight.wgsl")),
        ];
        let mut environment = Environment::new();
        environment.set_undefined_behavior(UndefinedBehavior::Strict);
        for &(name, text) in shared.iter().chain(own) {
            environment.add_template(name, text).map_err(|source| TemplateError { name: name.to_owned(), source })?;
        }
        Ok(Self { environment })
    }

    /// The text of `name` with `context` filled in.
    ///
    /// # Errors
    /// When the template uses what the context lacks.
    pub fn render(&self, name: &str, context: Value) -> Result<String, TemplateError> {
        let render = || self.environment.get_template(name)?.render(context);
        render().map_err(|source| TemplateError { name: name.to_owned(), source })
    }
}
