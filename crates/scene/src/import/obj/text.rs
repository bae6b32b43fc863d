//! Lines of OBJ and MTL files: bytes in any encoding, with any line ends.

use std::borrow::Cow;
use std::fmt;

use super::super::decoded;

/// A line as keyword and rest, trimmed.
pub(super) struct Line<'a> {
    /// The library, in messages; empty for the scene's own file.
    pub file: &'a str,
    /// Counts from 1; for a line that continues, that of its first part.
    pub number: usize,
    pub keyword: &'a [u8],
    /// May end in a comment: `#` may also be part of a name.
    pub rest: &'a [u8],
}

impl fmt::Display for Line<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let separator = if self.file.is_empty() { "" } else { ", " };
        write!(f, "{}{separator}line {} ({})", self.file, self.number, decoded(self.keyword))
    }
}

impl<'a> Line<'a> {
    /// Returns whether this is the statement, in upper or lower case.
    pub(super) fn is(&self, keyword: &str) -> bool {
        self.keyword.eq_ignore_ascii_case(keyword.as_bytes())
    }

    /// The words before a comment.
    pub(super) fn words(&self) -> impl Iterator<Item = &'a [u8]> {
        words(self.rest)
    }

    /// The first `N` numbers; NaN for a word that is no finite number, `None` for one that is not there.
    pub(super) fn numbers<const N: usize>(&self) -> [Option<f64>; N] {
        let mut words = self.words();
        std::array::from_fn(|_| words.next().map(|word| finite(word).unwrap_or(f64::NAN)))
    }
}

/// The words of a text before a comment.
pub(super) fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    let words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    words.take_while(|word| word[0] != b'#')
}

pub(super) fn finite(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok().filter(|number: &f64| number.is_finite())
}

/// A text without its comment, which begins with `#` at the start of a word.
pub(super) fn without_comment(text: &[u8]) -> &[u8] {
    let mut places = 0..text.len();
    let start = places.find(|&at| text[at] == b'#' && (at == 0 || text[at - 1].is_ascii_whitespace()));
    text[..start.unwrap_or(text.len())].trim_ascii()
}

/// Removes a byte order mark, and changes UTF-16 that has one to UTF-8. Bytes without a mark stay as they are.
pub(super) fn without_byte_order_mark(bytes: &[u8]) -> Cow<'_, [u8]> {
    match bytes {
        [0xef, 0xbb, 0xbf, rest @ ..] => Cow::Borrowed(rest),
        [0xff, 0xfe, rest @ ..] => Cow::Owned(from_utf_16(rest, u16::from_le_bytes)),
        [0xfe, 0xff, rest @ ..] => Cow::Owned(from_utf_16(rest, u16::from_be_bytes)),
        _ => Cow::Borrowed(bytes),
    }
}

fn from_utf_16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Vec<u8> {
    let units = bytes.as_chunks::<2>().0.iter().map(|&pair| unit(pair));
    let letters = char::decode_utf16(units).map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER));
    letters.collect::<String>().into_bytes()
}

/// Visits all lines except empty ones and comments, of which only `#MRGB` has data. Lines end with LF, CR
/// or both. A line that ends with a backslash continues on the next one, unless it is a comment.
pub(super) fn for_each_line<E>(
    mut text: &[u8],
    file: &str,
    mut visit: impl FnMut(&Line) -> Result<(), E>,
) -> Result<(), E> {
    let mut next_number = 1;
    let mut joined = Vec::new();
    while !text.is_empty() {
        let number = next_number;
        let mut line = next_line(&mut text, &mut next_number);
        if line.ends_with(b"\\") && !line.starts_with(b"#") {
            joined.clear();
            while let Some(part) = line.strip_suffix(b"\\") {
                joined.extend_from_slice(part);
                joined.push(b' ');
                line = next_line(&mut text, &mut next_number);
            }
            joined.extend_from_slice(line);
            line = joined.trim_ascii();
        }
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (keyword, rest) = line.split_at(end);
        let has_data = !keyword.is_empty() && (keyword[0] != b'#' || keyword.eq_ignore_ascii_case(b"#MRGB"));
        if has_data {
            visit(&Line { file, number, keyword, rest: rest.trim_ascii() })?;
        }
    }
    Ok(())
}

/// Takes a line off `text`, trimmed.
fn next_line<'t>(text: &mut &'t [u8], number: &mut usize) -> &'t [u8] {
    let end = text.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(text.len());
    let (line, rest) = text.split_at(end);
    *text = rest.strip_prefix(b"\r\n").or(rest.get(1..)).unwrap_or_default();
    *number += 1;
    line.trim_ascii()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &[u8]) -> Vec<(usize, String)> {
        let mut lines = Vec::new();
        let visited: Result<(), ()> = for_each_line(&without_byte_order_mark(text), "", |line| {
            lines.push((line.number, format!("{}|{}", decoded(line.keyword), decoded(line.rest))));
            Ok(())
        });
        visited.unwrap();
        lines
    }

    #[test]
    fn all_line_ends_are_counted_alike() {
        let expected = [(1, "v|1".to_owned()), (3, "f|2 # x".to_owned())];
        for end in ["\n", "\r\n", "\r"] {
            assert_eq!(lines(format!("v 1{end}# c{end}  f\t2 # x{end}").as_bytes()), expected, "{end:?}");
        }
    }

    #[test]
    fn lines_continue_after_a_backslash_even_at_the_end() {
        assert_eq!(lines(b"f 1 \\\r\n 2 3\\\n 4\nv 5 \\"), [(1, "f|1  2 3 4".to_owned()), (4, "v|5".to_owned())]);
        assert_eq!(lines(b"# C:\\dir\\\nv 1"), [(2, "v|1".to_owned())], "a comment does not");
    }

    #[test]
    fn utf_16_of_both_orders_is_read() {
        let units: Vec<u16> = "\u{feff}usemtl Öl".encode_utf16().collect();
        let little: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|unit| unit.to_be_bytes()).collect();
        for bytes in [little, big, "\u{feff}usemtl Öl".as_bytes().to_vec()] {
            assert_eq!(lines(&bytes), [(1, "usemtl|Öl".to_owned())]);
        }
    }
}
