//! Hierarchies of control groups that the system has mounted.

use std::fs;
use std::path::PathBuf;

use super::error::CpuShareError;

/// The place where groups are made.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs, reason = "self-naming fields")]
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
}
