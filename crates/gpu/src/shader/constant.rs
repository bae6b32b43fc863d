//! Numbers that Rust shares with WGSL: written once, in Rust.

/// A number that WGSL has a literal for.
pub trait WgslLiteral {
    /// The literal.
    fn wgsl_literal(self) -> String;
}

impl WgslLiteral for u32 {
    fn wgsl_literal(self) -> String {
        format!("{self}u")
    }
}

impl WgslLiteral for f32 {
    fn wgsl_literal(self) -> String {
        format!("{self:?}")
    }
}

/// The names and literals of constants: `{{ NAME }}` in a template.
#[macro_export]
macro_rules! wgsl_constants {
    ($($name:ident),* $(,)?) => { [$((stringify!($name), $crate::WgslLiteral::wgsl_literal($name))),*] };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_keep_their_type_and_value() {
        const STEPS: u32 = 3;
        const SLACK: f32 = 1e-6;
        let literals = wgsl_constants![STEPS, SLACK];
        assert_eq!(literals, [("STEPS", "3u".to_owned()), ("SLACK", "1e-6".to_owned())]);
        assert_eq!(1.0f32.wgsl_literal(), "1.0");
    }
}
