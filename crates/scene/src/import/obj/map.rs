//! Texture maps of MTL: options and a file name.

use glam::DVec2;

use super::super::{Warnings, decoded};
use super::text::{Line, finite, without_comment};

/// A texture map as a material names it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TextureMap {
    /// The statement, in messages.
    pub place: String,
    /// Spellings of the file's name: the last one is without comment and quotes.
    pub names: Vec<Vec<u8>>,
    pub placement: UvTransform,
    pub clamps: bool,
    /// The channel of a map of numbers, where the file chooses one.
    pub channel: Option<Channel>,
}

/// A change of texture coordinates: scaled, then moved, with v upwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UvTransform {
    pub scale: DVec2,
    pub offset: DVec2,
}

impl UvTransform {
    pub(super) const IDENTITY: Self = Self { scale: DVec2::ONE, offset: DVec2::ZERO };

    /// Changes coordinates whose v runs downwards.
    pub(super) fn apply(&self, [u, v_down]: [f32; 2]) -> [f32; 2] {
        let upwards = DVec2::new(f64::from(u), 1.0 - f64::from(v_down));
        let moved = upwards * self.scale + self.offset;
        let changed = [moved.x as f32, (1.0 - moved.y) as f32];
        if changed.iter().all(|c| c.is_finite()) { changed } else { [0.0; 2] }
    }
}

/// The channel of a picture that a map of numbers takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Channel {
    Red,
    Green,
    Blue,
    Alpha,
    Luminance,
}

impl TextureMap {
    /// Reads `-option arguments… file name`; `None` without a name.
    pub(super) fn parse(line: &Line, warnings: &Warnings) -> Option<Self> {
        let mut map = Self {
            place: format!("{line} {}", decoded(line.rest)),
            names: Vec::new(),
            placement: UvTransform::IDENTITY,
            clamps: false,
            channel: None,
        };
        let mut rest = Words { rest: line.rest };
        while rest.rest.starts_with(b"-") && rest.peek().len() < rest.rest.len() {
            let option = rest.next().to_ascii_lowercase();
            map.read_option(&option, &mut rest, line, warnings);
        }
        map.names = spellings(rest.rest);
        if rest.rest != line.rest && !map.names.is_empty() {
            // The name itself may begin with `-`.
            map.names.insert(0, line.rest.to_vec());
        }
        if map.names.is_empty() {
            warnings.count("texture maps without a file name are left out", line);
            return None;
        }
        Some(map)
    }

    fn read_option(&mut self, option: &[u8], rest: &mut Words, line: &Line, warnings: &Warnings) {
        match option {
            b"-s" => self.placement.scale = rest.vector(1.0),
            b"-o" => self.placement.offset = rest.vector(0.0),
            b"-clamp" => self.clamps = rest.next().eq_ignore_ascii_case(b"on"),
            b"-imfchan" => {
                self.channel = match rest.next().to_ascii_lowercase().as_slice() {
                    b"r" => Some(Channel::Red),
                    b"g" => Some(Channel::Green),
                    b"b" => Some(Channel::Blue),
                    b"m" => Some(Channel::Alpha),
                    b"l" => Some(Channel::Luminance),
                    _ => None,
                }
            }
            b"-mm" => {
                let base = finite(rest.next());
                let gain = finite(rest.next());
                if base != Some(0.0) || gain != Some(1.0) {
                    warnings.count("brightness (-mm) of texture maps is not shown", line);
                }
            }
            b"-t" => {
                if rest.vector(0.0) != DVec2::ZERO {
                    warnings.count("turbulence (-t) of texture maps is not shown", line);
                }
            }
            // Filters and resolutions change little that is seen. Each has one argument.
            b"-colorspace" | b"-blendu" | b"-blendv" | b"-boost" | b"-bm" | b"-cc" | b"-texres" | b"-type" => {
                rest.next();
            }
            _ => {
                warnings.count("unknown options of texture maps are skipped", line);
                while rest.is_argument() {
                    rest.next();
                }
            }
        }
    }
}

/// The spellings of a name that may end in a comment or stand in quotes.
pub(super) fn spellings(text: &[u8]) -> Vec<Vec<u8>> {
    let bare = without_comment(text);
    let quoted = quoted(text);
    let mut names: Vec<Vec<u8>> =
        [Some(text), Some(bare), quoted].into_iter().flatten().map(|n| n.trim_ascii().to_vec()).collect();
    names.dedup();
    if bare.is_empty() || names.last().is_some_and(Vec::is_empty) { Vec::new() } else { names }
}

/// The name of a text that is one name in quotes, and maybe a comment.
fn quoted(text: &[u8]) -> Option<&[u8]> {
    let inner = text.strip_prefix(b"\"")?;
    let end = inner.iter().position(|byte| *byte == b'"')?;
    let after = inner[end + 1..].trim_ascii_start();
    (after.is_empty() || after.starts_with(b"#")).then_some(&inner[..end])
}

struct Words<'a> {
    rest: &'a [u8],
}

impl<'a> Words<'a> {
    fn peek(&self) -> &'a [u8] {
        self.rest.split(u8::is_ascii_whitespace).next().unwrap_or_default()
    }

    fn next(&mut self) -> &'a [u8] {
        let word = self.peek();
        self.rest = self.rest[word.len()..].trim_ascii_start();
        word
    }

    /// Returns whether the next word is an option's argument rather than the file's name, which is last.
    fn is_argument(&self) -> bool {
        let word = self.peek();
        let is_last = word.len() == self.rest.len();
        !is_last && (finite(word).is_some() || word.eq_ignore_ascii_case(b"on") || word.eq_ignore_ascii_case(b"off"))
    }

    /// One to three numbers, of which two count.
    fn vector(&mut self, default: f64) -> DVec2 {
        let mut numbers = [default; 3];
        for number in &mut numbers {
            if self.is_argument() {
                *number = finite(self.next()).unwrap_or(default);
            }
        }
        DVec2::new(numbers[0], numbers[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(rest: &str) -> Option<TextureMap> {
        let line = Line { file: "", number: 1, keyword: b"map_Kd", rest: rest.as_bytes() };
        TextureMap::parse(&line, &Warnings::default())
    }

    fn name(rest: &str) -> String {
        String::from_utf8(parsed(rest).unwrap().names.pop().unwrap()).unwrap()
    }

    #[test]
    fn names_follow_options_and_may_have_spaces_quotes_and_comments() {
        for (rest, expected) in [
            ("t.png", "t.png"),
            ("a b.png", "a b.png"),
            ("-s 2 2 1 -o 0.5 0 0 a b.png", "a b.png"),
            ("-colorspace sRGB -o 0.1 3.jpg", "3.jpg"),
            ("-bm 0.5 -mm 0 1 -texres 512 2 3.png", "2 3.png"),
            ("-clamp on \"a b.png\" # note", "a b.png"),
            ("t.png # note", "t.png"),
            ("\"a #1.png\" # note", "a #1.png"),
            ("-new 1 on t.png", "t.png"),
            ("-s 2 t.png", "t.png"),
            ("-blendu on -imfchan m t#1.png", "t#1.png"),
            ("-t.png", "-t.png"),
        ] {
            assert_eq!(name(rest), expected, "{rest}");
        }
        for empty in ["", "# none", "\"\"", "-s 1 1 1 # none"] {
            assert_eq!(parsed(empty), None, "{empty:?}");
        }
    }

    #[test]
    fn options_are_read() {
        let map = parsed("-S 2 3 1 -o 0.5 -clamp on -imfchan g t.png").unwrap();
        assert_eq!(map.placement, UvTransform { scale: DVec2::new(2.0, 3.0), offset: DVec2::new(0.5, 0.0) });
        assert!(map.clamps && map.channel == Some(Channel::Green));
        // The upper left corner, (0, 1) upwards, is at (0.5, 3).
        assert_eq!(map.placement.apply([0.0, 0.0]), [0.5, -2.0]);
    }
}
