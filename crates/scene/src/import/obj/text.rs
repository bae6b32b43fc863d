//! Lines of OBJ and MTL files.

use std::fmt;

use crate::error::Fault;

/// Splits a line into keyword and rest, trimmed.
pub(super) struct Line<'a> {
    pub number: usize,
    pub keyword: &'a str,
    pub rest: &'a str,
}

impl fmt::Display for Line<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {} ({})", self.number, self.keyword)
    }
}

/// All lines except empty ones and comments. Lines that continue after a backslash are not joined; the backslash is
/// then refused as a number or corner.
pub(super) fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    let numbered = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    numbered.filter(|(_, line)| !line.is_empty() && !line.starts_with('#')).map(|(number, line)| {
        let (keyword, rest) = line.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((line, ""));
        Line { number, keyword, rest: rest.trim_start() }
    })
}

/// Parses up to `N` finite numbers, at least `required`; missing ones are 0.
pub(super) fn floats<const N: usize>(line: &Line, required: usize) -> Result<[f64; N], Fault> {
    let mut values = [0.0; N];
    let mut words = line.rest.split_ascii_whitespace();
    for (i, value) in values.iter_mut().enumerate() {
        match words.next() {
            Some(word) => {
                let number = word.parse().ok().filter(|n: &f64| n.is_finite());
                *value = number.ok_or_else(|| Fault::malformed(line, format!("{word:?} is not a finite number")))?;
            }
            None if i < required => {
                return Err(Fault::malformed(line, format!("{i} numbers where {required} are needed")));
            }
            None => break,
        }
    }
    Ok(values)
}
