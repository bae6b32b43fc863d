//! A share of the machine's processors for each node: a control group of Linux with a quota.
//!
//! The kernel lets a group run for its quota in every period and then stops it until the next one, so that several
//! nodes on few cores are as slow as if each had a slow processor of its own. Both versions of control groups work.

use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;
use std::{fs, io};

/// In which a quota is counted: short, so that a short operation is slowed as a long one is.
const PERIOD_US: u64 = 10_000;
/// The kernel takes no smaller quota.
const LEAST_QUOTA_US: f64 = 1_000.0;
/// A group is busy for a moment after its last process has ended.
const REMOVE_TRIES: u32 = 50;
const REMOVE_RETRY: Duration = Duration::from_millis(10);

/// Why nodes cannot be given a share.
#[derive(Debug, thiserror::Error)]
pub enum CpuShareError {
    /// Not Linux, or no controller.
    #[error(
        "no control groups with a cpu controller are mounted: nodes of equal, limited CPU share need Linux with cgroups"
    )]
    NotMounted,
    /// A cgroup file system without the controller where it is needed.
    #[error(
        "{} has no cpu.max: the cpu controller is not handed down to it. Run as root, or in a delegated group: \
         systemd-run --user --scope -p Delegate=yes myriorama bench scaling", path.display()
    )]
    NoController {
        /// The group.
        path: PathBuf,
    },
    /// No permission, most often.
    #[error("cannot write {}: {source}. Control groups are root's unless they are delegated", path.display())]
    Write {
        /// Which file or folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// What the kernel counts.
    #[error("cannot read {}: {reason}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

/// Where groups are made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Hierarchy {
    /// A controller each.
    V1 {
        /// Of the quota.
        cpu: PathBuf,
        /// Of the time used, which may be the same.
        accounting: PathBuf,
    },
    /// All controllers in one.
    V2(PathBuf),
}

impl Hierarchy {
    /// What this system has.
    ///
    /// # Errors
    /// Where nothing is mounted that could limit a process.
    pub fn find() -> Result<Self, CpuShareError> {
        let mounts = fs::read_to_string("/proc/mounts").map_err(|_| CpuShareError::NotMounted)?;
        Self::among(&mounts).ok_or(CpuShareError::NotMounted)
    }

    /// Version 1 where it holds the controller: version 2 is then mounted without it.
    fn among(mounts: &str) -> Option<Self> {
        let fields = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let mounted: Vec<_> = mounts.lines().map(fields).filter(|fields| fields.len() > 3).collect();
        let with = |controller: &str| {
            let holds = |fields: &&Vec<String>| fields[2] == "cgroup" && fields[3].split(',').any(|o| o == controller);
            mounted.iter().find(holds).map(|fields| PathBuf::from(&fields[1]))
        };
        let v2 = || mounted.iter().find(|fields| fields[2] == "cgroup2").map(|fields| Self::V2((&fields[1]).into()));
        match (with("cpu"), with("cpuacct")) {
            (Some(cpu), Some(accounting)) => Some(Self::V1 { cpu, accounting }),
            _ => v2(),
        }
    }
}

/// What a group has used so far.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Usage {
    /// Seconds of one core.
    pub cpu_s: f64,
    /// Periods in which it had something to do.
    pub periods: u64,
    /// Of these, in which it used up its quota and was stopped.
    pub throttled: u64,
}

impl Usage {
    /// Between two readings.
    #[must_use]
    pub fn since(&self, before: &Self) -> Self {
        Self {
            cpu_s: self.cpu_s - before.cpu_s,
            periods: self.periods.saturating_sub(before.periods),
            throttled: self.throttled.saturating_sub(before.throttled),
        }
    }
}

/// A group of processes that share a quota. It is removed when dropped, which its processes must not outlive.
#[derive(Debug)]
pub struct CpuGroup {
    /// Where the quota is; the time used is in the last.
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
    /// A group without a limit yet.
    ///
    /// # Errors
    /// Where groups cannot be made or have no quota.
    pub fn new(hierarchy: &Hierarchy, name: &str) -> Result<Self, CpuShareError> {
        let (parents, is_v2) = match hierarchy {
            Hierarchy::V1 { cpu, accounting } if cpu == accounting => (vec![cpu], false),
            Hierarchy::V1 { cpu, accounting } => (vec![cpu, accounting], false),
            Hierarchy::V2(root) => (vec![root], true),
        };
        if is_v2 {
            // It may be handed down already, and is not ours to write then.
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

    /// So many cores, or all there are.
    ///
    /// # Errors
    /// Where the kernel does not take it.
    pub fn limit(&self, cores: Option<f64>) -> Result<(), CpuShareError> {
        let (period_us, quota_us) = cores.map_or((PERIOD_US, None), |cores| {
            let period_us = period_us(cores);
            (period_us, Some((cores * period_us as f64).round() as u64))
        });
        let folder = &self.folders[0];
        if self.is_v2 {
            let quota = quota_us.map_or_else(|| "max".to_owned(), |quota_us| quota_us.to_string());
            return write(&folder.join("cpu.max"), &format!("{quota} {period_us}"));
        }
        write(&folder.join("cpu.cfs_period_us"), &period_us.to_string())?;
        let quota = quota_us.map_or_else(|| "-1".to_owned(), |quota_us| quota_us.to_string());
        write(&folder.join("cpu.cfs_quota_us"), &quota)
    }

    /// Lets the group go before other programs of the machine, as far as its quota goes: what they do then costs it
    /// little more than their place in the caches.
    ///
    /// # Errors
    /// Where the kernel does not take it.
    pub fn go_first(&self) -> Result<(), CpuShareError> {
        let (file, weight) = if self.is_v2 { ("cpu.weight", "10000") } else { ("cpu.shares", "262144") };
        write(&self.folders[0].join(file), weight)
    }

    /// Takes in a process with all its threads.
    ///
    /// # Errors
    /// Where it has ended, or is not ours to move.
    pub fn admit(&self, process: u32) -> Result<(), CpuShareError> {
        self.folders.iter().try_for_each(|folder| write(&folder.join("cgroup.procs"), &process.to_string()))
    }

    /// Used since the group was made.
    ///
    /// # Errors
    /// Where the kernel's counters cannot be read.
    pub fn usage(&self) -> Result<Usage, CpuShareError> {
        let stat_path = self.folders[0].join("cpu.stat");
        let stat = read(&stat_path)?;
        let count = |name: &str| {
            value_of(&stat, name)
                .ok_or_else(|| CpuShareError::Read { path: stat_path.clone(), reason: format!("no {name}") })
        };
        let cpu_s = if self.is_v2 { count("usage_usec")? as f64 * 1e-6 } else { self.usage_v1_s()? };
        Ok(Usage { cpu_s, periods: count("nr_periods")?, throttled: count("nr_throttled")? })
    }

    fn usage_v1_s(&self) -> Result<f64, CpuShareError> {
        let path = self.folders[self.folders.len() - 1].join("cpuacct.usage");
        let ns: Result<f64, _> = read(&path)?.trim().parse();
        ns.map(|ns| ns * 1e-9).map_err(|error| CpuShareError::Read { path, reason: error.to_string() })
    }
}

/// A group of this process and others that must not be waited for: the client and the coordinator. This process goes
/// to the root of all groups when it is dropped.
#[derive(Debug)]
pub struct OwnGroup(CpuGroup);

impl OwnGroup {
    /// With this process in it, before other programs.
    ///
    /// # Errors
    /// Where the group cannot be made, or this process not be moved.
    pub fn new(hierarchy: &Hierarchy, name: &str) -> Result<Self, CpuShareError> {
        let own = Self(CpuGroup::new(hierarchy, name)?);
        own.0.go_first()?;
        own.0.admit(std::process::id())?;
        Ok(own)
    }

    /// Takes in a process with all its threads.
    ///
    /// # Errors
    /// As [`CpuGroup::admit`].
    pub fn admit(&self, process: u32) -> Result<(), CpuShareError> {
        self.0.admit(process)
    }
}

impl Drop for OwnGroup {
    fn drop(&mut self) {
        for parent in self.0.folders.iter().filter_map(|folder| folder.parent()) {
            // Where it cannot go back the group stays, which is said when it is removed.
            let _ = write(&parent.join("cgroup.procs"), &std::process::id().to_string());
        }
    }
}

/// Longer for a quota that would be too small.
fn period_us(cores: f64) -> u64 {
    PERIOD_US.max((LEAST_QUOTA_US / cores).ceil() as u64)
}

fn value_of(stat: &str, name: &str) -> Option<u64> {
    stat.lines().find_map(|line| line.strip_prefix(name)?.trim().parse().ok())
}

fn write(path: &Path, text: &str) -> Result<(), CpuShareError> {
    fs::write(path, text).map_err(|source| CpuShareError::Write { path: path.to_owned(), source })
}

fn read(path: &Path) -> Result<String, CpuShareError> {
    fs::read_to_string(path).map_err(|error| CpuShareError::Read { path: path.to_owned(), reason: error.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_versions_are_found() {
        let v1 =
            "cgroup /c/cpu cgroup rw,relatime,cpu 0 0\ncgroup /c/cpuacct cgroup rw,cpuacct 0 0\nx /u cgroup2 rw 0 0";
        let found = Hierarchy::V1 { cpu: "/c/cpu".into(), accounting: "/c/cpuacct".into() };
        assert_eq!(Hierarchy::among(v1), Some(found));
        let both = "cgroup /c/both cgroup rw,cpu,cpuacct 0 0";
        let found = Hierarchy::V1 { cpu: "/c/both".into(), accounting: "/c/both".into() };
        assert_eq!(Hierarchy::among(both), Some(found));
        let v2 = "proc /proc proc rw 0 0\ncgroup /c/cpuset cgroup rw,cpuset 0 0\ncgroup2 /sys/fs/cgroup cgroup2 rw 0 0";
        assert_eq!(Hierarchy::among(v2), Some(Hierarchy::V2("/sys/fs/cgroup".into())));
        assert_eq!(Hierarchy::among("tmpfs /tmp tmpfs rw 0 0"), None);
    }

    #[test]
    fn a_quota_is_written_as_the_kernel_reads_it() {
        let folder = tempfile::tempdir().unwrap();
        let group = CpuGroup { folders: vec![folder.path().join("none")], is_v2: true };
        assert!(matches!(group.limit(Some(0.15)), Err(CpuShareError::Write { .. })));
        let group = CpuGroup { folders: vec![folder.path().to_owned()], is_v2: true };
        group.limit(Some(0.15)).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("cpu.max")).unwrap(), "1500 10000");
        group.limit(Some(0.02)).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("cpu.max")).unwrap(), "1000 50000");
        group.go_first().unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("cpu.weight")).unwrap(), "10000");
        group.limit(None).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("cpu.max")).unwrap(), "max 10000");
        fs::write(folder.path().join("cpu.stat"), "usage_usec 1500000\nnr_periods 7\nnr_throttled 5\n").unwrap();
        let usage = group.usage().unwrap();
        assert_eq!(usage, Usage { cpu_s: 1.5, periods: 7, throttled: 5 });
        assert_eq!(usage.since(&Usage { cpu_s: 0.5, periods: 2, throttled: 1 }).throttled, 4);
        // What a real group holds is the kernel's and goes with it.
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
