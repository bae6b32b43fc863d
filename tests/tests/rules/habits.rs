//! Habits that make Rust harder to read, counted in all sources but tests. The counts may only fall.

use std::fs;
use std::path::Path;

use crate::root;
use crate::structure::sources;

/// A habit with the most that there may be. Whoever removes some lowers the number.
struct Habit {
    name: &'static str,
    most: usize,
    count: fn(&str) -> usize,
}

const HABITS: [Habit; 3] = [
    Habit { name: "`let (a, b) = (x, y)` of unrelated values", most: 0, count: tuple_lets },
    Habit { name: "closures that name one expression", most: 46, count: closure_lets },
    Habit { name: "tuple parameters", most: 4, count: tuple_parameters },
];

#[test]
fn hard_to_read_habits_do_not_spread() {
    let code: Vec<String> = sources(&[".rs"])
        .iter()
        .filter(|file| !is_for_tests(file.strip_prefix(root()).expect("a file of the workspace")))
        .map(|file| without_test_modules(&fs::read_to_string(file).expect("text")))
        .collect();
    for Habit { name, most, count } in HABITS {
        let found: usize = code.iter().map(|text| count(text)).sum();
        println!("{name}: {found}, at most {most}");
        assert!(found <= most, "{name}: {found}, at most {most}");
    }
}

fn is_for_tests(file: &Path) -> bool {
    let name = file.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let folders = file.parent().into_iter().flat_map(Path::components);
    name.ends_with("_tests.rs")
        || ["tests.rs", "test_support.rs"].contains(&name)
        || folders
            .map(|folder| folder.as_os_str().to_string_lossy())
            .any(|folder| ["tests", "benches", "examples"].contains(&folder.as_ref()) || folder.ends_with("-tests"))
}

/// A formatted text without its modules of tests.
fn without_test_modules(text: &str) -> String {
    let mut code = String::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        if line.trim_start().starts_with("#[cfg(test)]") {
            while lines.peek().is_some_and(|next| next.trim_start().starts_with("#[")) {
                lines.next();
            }
            let indent = &line[..line.len() - line.trim_start().len()];
            if lines.peek().is_some_and(|next| next.contains("mod ") && next.ends_with('{')) {
                let end = format!("{indent}}}");
                lines.by_ref().find(|line| *line == end);
                continue;
            }
        }
        code.push_str(line);
        code.push('\n');
    }
    code
}

/// The text from the first word of each line on.
fn from_each_line(text: &str) -> impl Iterator<Item = &str> {
    let starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1));
    starts.map(|start| text[start..].trim_start_matches(' '))
}

/// The text behind a tuple of at least two names, as in `(a, b)`.
fn after_tuple(text: &str) -> Option<&str> {
    let (names, rest) = text.strip_prefix('(')?.split_once(')')?;
    let is_name = |name: &str| {
        let name = name.strip_prefix("mut ").unwrap_or(name);
        !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_')
    };
    (names.contains(", ") && names.split(", ").all(is_name)).then_some(rest)
}

fn tuple_lets(text: &str) -> usize {
    let is_one = |text: &str| {
        let rest = after_tuple(text.strip_prefix("let ")?)?;
        let (ty, value) = rest.split_once('=')?;
        let has_type = ty.trim_start().starts_with(':');
        ((has_type || ty.trim().is_empty()) && value.trim_start().starts_with('(')).then_some(())
    };
    from_each_line(text).filter_map(is_one).count()
}

fn closure_lets(text: &str) -> usize {
    let is_one = |text: &str| {
        let (name, value) = text.strip_prefix("let ")?.split_once('=')?;
        let is_name = name.trim_end().chars().all(|c| c.is_alphanumeric() || c == '_');
        let value = value.trim_start();
        (is_name && value.strip_prefix("move ").unwrap_or(value).starts_with('|')).then_some(())
    };
    from_each_line(text).filter_map(is_one).count()
}

fn tuple_parameters(text: &str) -> usize {
    let is_typed = |text: &str| after_tuple(text).is_some_and(|rest| rest.starts_with(": ("));
    let on_own_line = from_each_line(text).filter(|text| is_typed(text)).count();
    // On the function's line, alone or behind other parameters.
    let in_line = text.match_indices("fn ").filter(|(at, _)| {
        let Some((_, parameters)) = text[*at..].split_once('(') else { return false };
        let Some(end) = parameters.find(['(', ')']) else { return false };
        (end == 0 || parameters[..end].ends_with(", ")) && is_typed(&parameters[end..])
    });
    on_own_line + in_line.count()
}

#[test]
fn habits_are_seen() {
    let text = "\
fn f((a, b): (u8, u8)) {
    let (a, mut b) = (1, 2);
    let (c, d): (u8, u8) =
        (1, 2);
    let (e, f) = pair();
    let g = |x| x + 1;
    let h =
        move || 1;
    let i = j | k;
}
fn g(
    self,
    (a, b): (u8, u8),
) {
}
fn h(x: u8, (a, b): (u8, u8), y: &(u8, u8)) {}
#[cfg(test)]
mod tests {
    let (a, b) = (1, 2);
}
";
    let code = without_test_modules(text);
    assert_eq!(HABITS.map(|habit| (habit.count)(&code)), [2, 2, 3]);
}
