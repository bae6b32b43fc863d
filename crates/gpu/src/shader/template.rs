//! WGSL templates: includes, loops over cameras written out, and switches, by `minijinja`.
//!
//! `{% include "color.wgsl" %}` takes text from this crate; the rest is Jinja as usual. Resources have a group and no
//! number (`@group(0) var<uniform> camera: Camera;`): they are bound by name. Numbers that Rust shares with WGSL are
//! written once, in Rust.

use std::{collections::HashMap, fmt::Debug};

use depth_image::{LOBE_ROUGHNESS, LOBE_SIZE_PX};
use minijinja::{Environment, UndefinedBehavior, Value};

use super::interface::DynamicUniforms;
use crate::cube_walk::{
    ENTRY_DEPTH_BELOW, ENTRY_DEPTH_STEP, HIT_SLACK, MAX_CUBE_STEPS, MORE_ENTRIES, SQUARE_REACH, WALK_NUDGE,
};
use crate::{error::ShaderError, table::TABLE_WIDTH_LOG2};

/// Shader texts by name.
pub struct Templates {
    environment: Environment<'static>,
    declared: Vec<(&'static str, String)>,
    /// Uniforms with dynamic offsets in all templates.
    pub(super) dynamic_uniforms: DynamicUniforms,
}

/// A number that WGSL has a literal for.
pub trait WgslLiteral: Debug + Copy {
    /// The literal's type.
    const SUFFIX: char;

    /// The literal.
    fn wgsl_literal(self) -> String {
        format!("{self:?}{}", Self::SUFFIX)
    }
}

macro_rules! wgsl_literals {
    ($($number:ty = $suffix:literal),*) => { $(impl WgslLiteral for $number { const SUFFIX: char = $suffix; })* };
}
wgsl_literals! { u16 = 'u', u32 = 'u', i32 = 'i', f32 = 'f' }

/// The names and literals of constants.
#[macro_export]
macro_rules! wgsl_constants {
    ($($name:ident),* $(,)?) => { [$((stringify!($name), $crate::WgslLiteral::wgsl_literal($name))),*] };
}

/// The names and texts of WGSL files beside the file that says so.
#[macro_export]
macro_rules! wgsl_files {
    ($($name:literal),+ $(,)?) => { [$(($name, include_str!($name))),+] };
}

macro_rules! shared_files {
    ($($name:ident)*) => {
        [$((concat!(stringify!($name), ".wgsl"), include_str!(concat!("../wgsl/", stringify!($name), ".wgsl")))),*]
    };
}

const SHARED: [(&str, &str); 11] =
    shared_files! { background color cube_walk normal light environment highlight sequence lobe table tone };

impl Templates {
    /// The shared includes, and `own` templates as (name, text).
    ///
    /// # Errors
    /// When a text is not a template.
    pub fn new(own: &[(&'static str, &'static str)]) -> Result<Self, ShaderError> {
        let mut environment = Environment::new();
        environment.set_undefined_behavior(UndefinedBehavior::Strict);
        environment.add_global("table_width_log2", TABLE_WIDTH_LOG2);
        environment.add_global("lobe_size_px", LOBE_SIZE_PX.to_array().to_vec());
        environment.add_global("lobe_roughness", LOBE_ROUGHNESS.to_vec());
        for &(name, text) in SHARED.iter().chain(own) {
            environment
                .add_template(name, text)
                .map_err(|source| ShaderError::Template { name: name.to_owned(), source })?;
        }
        let declared = crate::wgsl_constants! {
            ENTRY_DEPTH_BELOW, ENTRY_DEPTH_STEP, HIT_SLACK, MAX_CUBE_STEPS, MORE_ENTRIES, SQUARE_REACH, WALK_NUDGE
        };
        Ok(Self { environment, declared: declared.to_vec(), dynamic_uniforms: &[] })
    }

    /// Adds values for `{{ NAME }}` in all templates, such as those of [`wgsl_constants!`](crate::wgsl_constants).
    #[must_use]
    pub fn with_constants(mut self, constants: impl IntoIterator<Item = (&'static str, impl Into<Value>)>) -> Self {
        constants.into_iter().for_each(|(name, value)| self.environment.add_global(name, value));
        self
    }

    /// Gives uniforms of these names dynamic offsets, in all variants that name none of their own.
    #[must_use]
    pub fn with_dynamic_uniforms(self, dynamic_uniforms: DynamicUniforms) -> Self {
        Self { dynamic_uniforms, ..self }
    }

    /// Declares numbers of [`wgsl_constants!`](crate::wgsl_constants) in all texts that name them. A template cannot declare
    /// a constant of such a name itself.
    #[must_use]
    pub fn declaring(mut self, constants: impl IntoIterator<Item = (&'static str, String)>) -> Self {
        self.declared.extend(constants);
        self
    }

    /// The WGSL of `name` with `context` filled in.
    ///
    /// # Errors
    /// When the template uses what the context lacks.
    pub fn render(&self, name: &str, context: Value) -> Result<String, ShaderError> {
        let text = self.environment.get_template(name).and_then(|template| template.render(context));
        let text = text.map_err(|source| ShaderError::Template { name: name.to_owned(), source })?;
        let named = self.declared.iter().filter(|(name, _)| text.contains(name));
        // At the end: directives come first.
        let declarations = named.map(|(name, literal)| format!("\nconst {name} = {literal};"));
        Ok([with_binding_numbers(&text)].into_iter().chain(declarations).collect())
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
    use minijinja::context;

    use super::*;

    #[test]
    fn constants_keep_their_type_and_value_and_are_declared_where_they_are_named() {
        const STEPS: u32 = 3;
        const SLACK: f32 = 1e-6;
        let literals = wgsl_constants![STEPS, SLACK];
        assert_eq!(literals, [("STEPS", "3u".to_owned()), ("SLACK", "1e-6f".to_owned())]);
        assert_eq!([1.0f32.wgsl_literal(), 7_u16.wgsl_literal(), (-2_i32).wgsl_literal()], ["1.0f", "7u", "-2i"]);
        let templates = Templates::new(&[("f", "fn f() -> f32 { return SLACK; }")]).expect("a template");
        let text = templates.declaring(literals).render("f", context! {}).expect("a text");
        assert_eq!(text, "fn f() -> f32 { return SLACK; }\nconst SLACK = 1e-6f;");
    }

    #[test]
    fn bindings_are_numbered_within_their_group() {
        let text = "// Two groups.\n@group(0) var a: A;\n@group(1) var b: B;\n@group(0) var c: C;\n";
        let wgsl = "// Two groups.\n@group(0) @binding(0) var a: A;\n@group(1) @binding(0) var b: B;\n@group(0) @binding(1) var c: C;\n";
        assert_eq!(with_binding_numbers(text), wgsl);
        assert_eq!(with_binding_numbers("fn f() {}"), "fn f() {}");
    }
}
