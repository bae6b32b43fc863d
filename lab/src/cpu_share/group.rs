//! Control groups with a quota of processor time.

use std::fs;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;

use super::error::CpuShareError;
use super::hierarchy::Hierarchy;
use super::usage::Usage;

/// The period of a quota: short, so that a short operation is slowed as a long one is.
const PERIOD_US: u64 = 10_000;
/// The least quota that the kernel takes.
const LEAST_QUOTA_US: f64 = 1_000.0;
/// A group is busy for a moment after its last process has ended.
const REMOVE_TRIES: u32 = 50;
const REMOVE_RETRY: Duration = Duration::from_millis(10);

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

    /// Limits the group to a number of cores, or to none.
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

    /// Runs the group ahead of other programs of the machine, within its quota: they then cost it little more than
    /// their place in the caches.
    pub fn prioritize(&self) -> Result<(), CpuShareError> {
        let (file, weight) = if self.is_v2 { ("cpu.weight", "10000") } else { ("cpu.shares", "262144") };
        write(&self.folders[0].join(file), weight)
    }

    /// Adds a process with all its threads.
    ///
    /// # Errors
    /// The process has ended, or cannot be moved by this user.
    pub fn admit(&self, process: u32) -> Result<(), CpuShareError> {
        self.folders.iter().try_for_each(|folder| write(&folder.join("cgroup.procs"), &process.to_string()))
    }

    /// The processor time that the group has used.
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

    pub(super) fn folders(&self) -> &[PathBuf] {
        &self.folders
    }

    fn usage_v1_s(&self) -> Result<f64, CpuShareError> {
        let path = self.folders[self.folders.len() - 1].join("cpuacct.usage");
        let ns: Result<f64, _> = read(&path)?.trim().parse();
        ns.map(|ns| ns * 1e-9).map_err(|error| CpuShareError::Read { path, reason: error.to_string() })
    }
}

/// The period of a quota, longer where the quota would be too small.
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
    fn a_quota_is_written_as_the_kernel_reads_it() {
        let folder = tempfile::tempdir().unwrap();
        let group = CpuGroup { folders: vec![folder.path().join("none")], is_v2: true };
        assert!(matches!(group.limit(Some(0.15)), Err(CpuShareError::Write { .. })));
        let group = CpuGroup { folders: vec![folder.path().to_owned()], is_v2: true };
        group.limit(Some(0.15)).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("cpu.max")).unwrap(), "1500 10000");
        group.limit(Some(0.02)).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("cpu.max")).unwrap(), "1000 50000");
        group.prioritize().unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("cpu.weight")).unwrap(), "10000");
        group.limit(None).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("cpu.max")).unwrap(), "max 10000");
        fs::write(folder.path().join("cpu.stat"), "usage_usec 1500000\nnr_periods 7\nnr_throttled 5\n").unwrap();
        let usage = group.usage().unwrap();
        assert_eq!(usage, Usage { cpu_s: 1.5, periods: 7, throttled: 5 });
        assert_eq!(usage.since(&Usage { cpu_s: 0.5, periods: 2, throttled: 1 }).throttled, 4);
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
