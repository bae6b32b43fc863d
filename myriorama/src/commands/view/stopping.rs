//! The end of a request before all its views are written.

use std::path::Path;

use tokio_util::sync::CancellationToken;

use super::record::Record;

/// The result of some work; `None` where `stop` came first.
///
/// # Errors
/// Those of the work.
pub(super) async fn until<T>(
    stop: &CancellationToken,
    work: impl Future<Output = anyhow::Result<T>>,
) -> anyhow::Result<Option<T>> {
    tokio::select! {
        done = work => done.map(Some),
        () = stop.cancelled() => Ok(None),
    }
}

/// What is written, and the command that goes on from there.
pub(super) fn how_to_resume(record: &Record, folder: &Path) -> String {
    let count = record.count();
    let total = record.total();
    let command = resuming(std::env::args_os().skip(1).map(|argument| argument.to_string_lossy().into_owned()));
    format!("{count} of {total} views are written to {}; `myriorama {command}` asks for the rest", folder.display())
}

/// The arguments of a command that resumes, as a shell reads them.
fn resuming(arguments: impl Iterator<Item = String>) -> String {
    let mut words: Vec<String> = arguments.map(|argument| quoted(&argument)).collect();
    if !words.iter().any(|word| word == "--resume") {
        words.push("--resume".to_owned());
    }
    words.join(" ")
}

fn quoted(argument: &str) -> String {
    if !argument.is_empty() && argument.chars().all(|c| c.is_ascii_alphanumeric() || "-_./:=,@%+".contains(c)) {
        return argument.to_owned();
    }
    format!("'{}'", argument.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_that_resumes_can_be_pasted_into_a_shell() {
        let command = |words: &[&str]| resuming(words.iter().map(|word| (*word).to_owned()));
        assert_eq!(command(&["view", "--orbit", "4"]), "view --orbit 4 --resume");
        assert_eq!(command(&["view", "--resume", "--lighting", "soft 4"]), "view --resume --lighting 'soft 4'");
        assert_eq!(command(&["view", "--out", "it's"]), r"view --out 'it'\''s' --resume");
    }
}
