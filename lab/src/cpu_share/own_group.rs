//! The group of this process.

use super::error::CpuShareError;
use super::group::CpuGroup;
use super::hierarchy::Hierarchy;

/// A group of this process, the client, and of the coordinator: processes that nodes must not wait for. Dropping it
/// moves this process to the root of all groups.
#[derive(Debug)]
pub struct OwnGroup(CpuGroup);

impl OwnGroup {
    /// Makes the group, ahead of other programs, with this process in it.
    ///
    /// # Errors
    /// The group cannot be made, or this process cannot be moved.
    pub fn new(hierarchy: &Hierarchy, name: &str) -> Result<Self, CpuShareError> {
        let own = Self(CpuGroup::new(hierarchy, name)?);
        own.0.prioritize()?;
        own.0.admit(std::process::id())?;
        Ok(own)
    }

    /// Adds a process with all its threads.
    ///
    /// # Errors
    /// As [`CpuGroup::admit`].
    pub fn admit(&self, process: u32) -> Result<(), CpuShareError> {
        self.0.admit(process)
    }
}

impl Drop for OwnGroup {
    fn drop(&mut self) {
        for parent in self.0.folders().iter().filter_map(|folder| folder.parent()) {
            // A process that cannot go back keeps the group, which is logged when it is removed.
            let _ = std::fs::write(parent.join("cgroup.procs"), std::process::id().to_string());
        }
    }
}
