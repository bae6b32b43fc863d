//! A share of the machine's processors for each node: a control group of Linux with a quota.
//!
//! The kernel lets a group run for its quota in every period and then stops it until the next one. Several nodes on few
//! cores are then as slow as if each had a slow processor of its own. Both versions of control groups work.

use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;
use std::{fs, io};

/// The period of a quota: short, so that a short operation is slowed as a long one is.
const PERIOD_US: u64 = 10_000;
/// The least quota that the kernel takes.
const LEAST_QUOTA_US: f64 = 1_000.0;
/// A group is busy for a moment after its last process has ended.
const REMOVE_TRIES: u32 = 50;
const REMOVE_RETRY: Duration = Duration::from_millis(10);

/// A share that nodes cannot be given.
#[derive(Debug, thiserror::Error)]
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

/// The place where groups are made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Hierarchy {
    /// One hierarchy a controller; those of quota and time used may be the same.
    V1 { cpu: PathBuf, accounting: PathBuf },
    /// One hierarchy for all controllers.
    V2(PathBuf),
}

impl Hierarchy {
    /// Finds the hierarchy of this system.
    ///
    /// # Errors
    /// No controller that limits processors is mounted.
    pub fn find() -> Result<Self, CpuShareError> {
        let mounts = fs::read_to_string("/proc/mounts").map_err(|_| CpuShareError::NotMounted)?;
        Self::parse(&mounts).ok_or(CpuShareError::NotMounted)
    }

    /// Version 1 where it holds the controller: version 2 is then mounted without it.
    fn parse(mounts: &str) -> Option<Self> {
        let lines = mounts.lines().map(|line| line.split_whitespace().collect());
        let mounted: Vec<Vec<&str>> = lines.filter(|fields: &Vec<&str>| fields.len() > 3).collect();
        let folders = ["cpu", "cpuacct"].map(|controller| {
            let mut v1 = mounted.iter().filter(|fields| fields[2] == "cgroup");
            let found = v1.find(|fields| fields[3].split(',').any(|option| option == controller));
            found.map(|fields| PathBuf::from(fields[1]))
        });
        match folders {
            [Some(cpu), Some(accounting)] => Some(Self::V1 { cpu, accounting }),
            _ => mounted.iter().find(|fields| fields[2] == "cgroup2").map(|fields| Self::V2(fields[1].into())),
        }
    }
}

/// A group of processes that share a quota. It is removed when dropped, which its processes must not outlive.
#[derive(Debug)]
pub struct CpuGroup {
    /// The folder of the quota first, the folder of the time used last.
    folders: Vec<PathBuf>,
    is_v2: bool,
}

impl Drop for CpuGroup {
    fn drop(&mut self) {
        for folder in &self.folders {
            let removed = (0..REMOVE_TRIES).any(|_| {
                let gone = fs::remove_dir(folder).is_ok() || !folder.exists();
                if !gone {
                    sleep(REMOVE_RETRY);
                }
                gone
            });
            if !removed {
                tracing::warn!(folder = %folder.display(), "a control group could not be removed");
            }
        }
    }
}

impl CpuGroup {
    /// Makes a group without a limit.
    ///
    /// # Errors
    /// Groups cannot be made, or have no quota.
    pub fn new(hierarchy: &Hierarchy, name: &str) -> Result<Self, CpuShareError> {
        let (parents, is_v2) = match hierarchy {
            Hierarchy::V1 { cpu, accounting } if cpu == accounting => (vec![cpu], false),
            Hierarchy::V1 { cpu, accounting } => (vec![cpu, accounting], false),
            Hierarchy::V2(root) => (vec![root], true),
        };
        if is_v2 {
            // The controller may be delegated already, and the file is then not writable.
            let _ = write(&parents[0].join("cgroup.subtree_control"), "+cpu");
        }
        let mut group = Self { folders: Vec::new(), is_v2 };
        for parent in parents {
            let path = parent.join(name);
            fs::create_dir(&path).map_err(|source| CpuShareError::Write { path: path.clone(), source })?;
            group.folders.push(path);
        }
        match is_v2 && !group.folders[0].join("cpu.max").exists() {
            true => Err(CpuShareError::NoController { path: group.folders[0].clone() }),
            false => Ok(group),
        }
    }

    /// Limits the group to a number of cores.
    ///
    /// # Errors
    /// The quota cannot be written.
    pub fn limit(&self, cores: f64) -> Result<(), CpuShareError> {
        // Longer where the quota would be too small.
        let period_us = PERIOD_US.max((LEAST_QUOTA_US / cores).ceil() as u64);
        let quota_us = (cores * period_us as f64).round() as u64;
        let folder = &self.folders[0];
        if self.is_v2 {
            return write(&folder.join("cpu.max"), &format!("{quota_us} {period_us}"));
        }
        write(&folder.join("cpu.cfs_period_us"), &period_us.to_string())?;
        write(&folder.join("cpu.cfs_quota_us"), &quota_us.to_string())
    }

    /// Adds a process with all its threads.
    ///
    /// # Errors
    /// The process has ended, or cannot be moved by this user.
    pub fn admit(&self, process: u32) -> Result<(), CpuShareError> {
        self.folders.iter().try_for_each(|folder| write(&folder.join("cgroup.procs"), &process.to_string()))
    }

    /// The processor time that the group has used, in seconds of one core.
    ///
    /// # Errors
    /// The kernel does not tell.
    pub fn used_s(&self) -> Result<f64, CpuShareError> {
        let file = if self.is_v2 { "cpu.stat" } else { "cpuacct.usage" };
        let path = self.folders[self.folders.len() - 1].join(file);
        let text = fs::read_to_string(&path)
            .map_err(|error| CpuShareError::Read { path: path.clone(), reason: error.to_string() })?;
        let number = match self.is_v2 {
            true => text.lines().find_map(|line| line.strip_prefix("usage_usec")),
            false => Some(text.as_str()),
        };
        let number = number.and_then(|number| number.trim().parse::<f64>().ok());
        let unit_s = if self.is_v2 { 1e-6 } else { 1e-9 };
        let used_s = number.map(|number| number * unit_s);
        used_s.ok_or_else(|| CpuShareError::Read { path, reason: "no processor time".to_owned() })
    }
}

fn write(path: &Path, text: &str) -> Result<(), CpuShareError> {
    fs::write(path, text).map_err(|source| CpuShareError::Write { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_versions_of_mounts_are_found() {
        let v1 =
            "cgroup /c/cpu cgroup rw,relatime,cpu 0 0\ncgroup /c/cpuacct cgroup rw,cpuacct 0 0\nx /u cgroup2 rw 0 0";
        let found = Hierarchy::V1 { cpu: "/c/cpu".into(), accounting: "/c/cpuacct".into() };
        assert_eq!(Hierarchy::parse(v1), Some(found));
        let both = "cgroup /c/both cgroup rw,cpu,cpuacct 0 0";
        let found = Hierarchy::V1 { cpu: "/c/both".into(), accounting: "/c/both".into() };
        assert_eq!(Hierarchy::parse(both), Some(found));
        let v2 = "proc /proc proc rw 0 0\ncgroup /c/cpuset cgroup rw,cpuset 0 0\ncgroup2 /sys/fs/cgroup cgroup2 rw 0 0";
        assert_eq!(Hierarchy::parse(v2), Some(Hierarchy::V2("/sys/fs/cgroup".into())));
        assert_eq!(Hierarchy::parse("tmpfs /tmp tmpfs rw 0 0"), None);
    }

    #[test]
    fn a_quota_is_written_as_the_kernel_reads_it() {
        let folder = tempfile::tempdir().unwrap();
        let group = CpuGroup { folders: vec![folder.path().join("none")], is_v2: true };
        assert!(matches!(group.limit(0.15), Err(CpuShareError::Write { .. })));
        let group = CpuGroup { folders: vec![folder.path().to_owned()], is_v2: true };
        group.limit(0.15).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("cpu.max")).unwrap(), "1500 10000");
        group.limit(0.02).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("cpu.max")).unwrap(), "1000 50000");
        fs::write(folder.path().join("cpu.stat"), "usage_usec 1500000\nnr_periods 7\nnr_throttled 5\n").unwrap();
        assert_eq!(group.used_s().unwrap(), 1.5);
        // The folder of a real group is removed by the kernel with its files, this one is not.
        std::mem::forget(group);
    }

    #[test]
    fn a_folder_that_cannot_hold_groups_is_named() {
        let nowhere = Hierarchy::V2("/nowhere/at/all".into());
        let error = CpuGroup::new(&nowhere, "g").unwrap_err();
        assert!(error.to_string().contains("/nowhere/at/all/g"), "{error}");
        let folder = tempfile::tempdir().unwrap();
        let error = CpuGroup::new(&Hierarchy::V2(folder.path().into()), "g").unwrap_err();
        assert!(matches!(error, CpuShareError::NoController { .. }) && !folder.path().join("g").exists());
    }
}
