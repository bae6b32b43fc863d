//! Keys of a keyboard, as events name them.

use serde_json::{Value, json};

/// The bit of Shift among the modifiers of an event.
pub(crate) const SHIFT: u32 = 8;

/// A key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Key {
    /// The key that types a letter, a digit, a space, `+` or `-`; with Shift where a US keyboard needs it.
    Character(char),
    /// Enter.
    Enter,
    /// Escape.
    Escape,
    /// Tab.
    Tab,
    /// Arrow to the left.
    Left,
    /// Arrow upwards.
    Up,
    /// Arrow to the right.
    Right,
    /// Arrow downwards.
    Down,
    /// Home.
    Home,
    /// End.
    End,
}

impl From<char> for Key {
    fn from(character: char) -> Self {
        Self::Character(character)
    }
}

/// How events name a key.
struct KeyNames {
    key: String,
    code: String,
    windows_code: u32,
    /// The text that the key types; empty where it types none.
    text: String,
}

impl Key {
    /// The parameters of `Input.dispatchKeyEvent`.
    pub(crate) fn event(self, is_down: bool) -> Value {
        let KeyNames { key, code, windows_code, text } = self.names();
        let kind = match (is_down, text.is_empty()) {
            (false, _) => "keyUp",
            (true, false) => "keyDown",
            (true, true) => "rawKeyDown",
        };
        let is_shifted = matches!(self, Self::Character('A'..='Z' | '+'));
        json!({
            "type": kind, "key": key, "code": code, "windowsVirtualKeyCode": windows_code,
            "text": if is_down { text } else { String::new() }, "modifiers": if is_shifted { SHIFT } else { 0 },
        })
    }

    fn names(self) -> KeyNames {
        let (name, windows_code, text) = match self {
            Self::Character(character) => return names_of_character(character),
            Self::Enter => ("Enter", 13, "\r"),
            Self::Escape => ("Escape", 27, ""),
            Self::Tab => ("Tab", 9, ""),
            Self::Left => ("ArrowLeft", 37, ""),
            Self::Up => ("ArrowUp", 38, ""),
            Self::Right => ("ArrowRight", 39, ""),
            Self::Down => ("ArrowDown", 40, ""),
            Self::Home => ("Home", 36, ""),
            Self::End => ("End", 35, ""),
        };
        KeyNames { key: name.to_owned(), code: name.to_owned(), windows_code, text: text.to_owned() }
    }
}

fn names_of_character(character: char) -> KeyNames {
    let upper = character.to_ascii_uppercase();
    let (code, windows_code) = match upper {
        'A'..='Z' => (format!("Key{upper}"), u32::from(upper)),
        '0'..='9' => (format!("Digit{upper}"), u32::from(upper)),
        ' ' => ("Space".to_owned(), 32),
        '+' => ("Equal".to_owned(), 187),
        '-' => ("Minus".to_owned(), 189),
        _ => (String::new(), 0),
    };
    KeyNames { key: character.to_string(), code, windows_code, text: character.to_string() }
}
