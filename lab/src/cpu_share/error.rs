//! Errors of control groups.

use std::io;
use std::path::PathBuf;

/// A share that nodes cannot be given.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum CpuShareError {
    /// The system is not Linux, or has no controller.
    #[error(
        "no control groups with a cpu controller are mounted: nodes of equal, limited CPU share need Linux with cgroups"
    )]
    NotMounted,
    /// A cgroup file system without the controller where it is needed.
    #[error(
        "{} has no cpu.max: the cpu controller is not handed down to it. Run as root, or in a delegated group: \
         systemd-run --user --scope -p Delegate=yes myriorama-lab bench scaling", path.display()
    )]
    NoController { path: PathBuf },
    /// Most often there is no permission.
    #[error("cannot write {}: {source}. Control groups are root's unless they are delegated", path.display())]
    Write { path: PathBuf, source: io::Error },
    /// A counter of the kernel cannot be read.
    #[error("cannot read {}: {reason}", path.display())]
    Read { path: PathBuf, reason: String },
}
