//! Membership: one process for each node name.

use std::collections::{HashMap, HashSet};

use cluster::limits::MAX_NODES;
use cluster::{NodeStatus, Welcome};
use parking_lot::Mutex;
use tokio::sync::mpsc;
use tonic::Status;

/// The stream by which a member hears of its membership: a welcome, and an end.
pub(crate) type MembershipStream = mpsc::Receiver<Result<Welcome, Status>>;

struct Membership {
    incarnation: u64,
    address: String,
    stream: mpsc::Sender<Result<Welcome, Status>>,
    /// Addresses of earlier processes of this name, which may not take the name back while this one is a member.
    replaced: HashSet<String>,
}

/// Members by name. The later of two processes with one name counts; the earlier waits until the later has left, or they
/// would replace each other forever.
#[derive(Default)]
pub(crate) struct MembershipRegistry(Mutex<HashMap<String, Membership>>);

impl MembershipRegistry {
    /// Registers a node; an earlier process of that name has to leave.
    pub(crate) fn join(
        &self,
        node: &NodeStatus,
        incarnation: u64,
        welcome: Welcome,
    ) -> Result<MembershipStream, Status> {
        let mut members = self.0.lock();
        if members.len() >= MAX_NODES && !members.contains_key(&node.node_name) {
            return Err(Status::resource_exhausted(format!("node_name: there are {MAX_NODES} nodes")));
        }
        let mut replaced = HashSet::new();
        if let Some(before) = members.get(&node.node_name).filter(|before| before.address != node.address) {
            if before.replaced.contains(&node.address) {
                return Err(taken(&node.node_name, &before.address));
            }
            replaced.extend(before.replaced.iter().cloned().chain([before.address.clone()]));
        }
        let (stream, receiver) = mpsc::channel(2);
        let _ = stream.try_send(Ok(welcome));
        let membership = Membership { incarnation, address: node.address.clone(), stream, replaced };
        if let Some(before) = members.insert(node.node_name.clone(), membership) {
            let _ = before.stream.try_send(Err(taken(&node.node_name, &node.address)));
        }
        Ok(receiver)
    }

    /// The membership has ended.
    pub(crate) fn leave(&self, node_name: &str, incarnation: u64) {
        let mut members = self.0.lock();
        if members.get(node_name).is_some_and(|member| member.incarnation == incarnation) {
            members.remove(node_name);
        }
    }
}

fn taken(node_name: &str, address: &str) -> Status {
    Status::already_exists(format!("node_name: {node_name} is the process at {address}, which joined later"))
}

#[cfg(test)]
mod tests {
    use tonic::Code;

    use super::*;

    fn node(address: &str) -> NodeStatus {
        NodeStatus {
            node_name: "n".to_owned(),
            address: address.to_owned(),
            device_name: String::new(),
            is_software: true,
        }
    }

    fn join(registry: &MembershipRegistry, address: &str, incarnation: u64) -> Result<MembershipStream, Code> {
        let joined = registry.join(&node(address), incarnation, Welcome::default());
        let mut stream = joined.map_err(|status| status.code())?;
        assert_eq!(stream.try_recv().unwrap().unwrap(), Welcome::default());
        Ok(stream)
    }

    #[test]
    fn the_later_process_of_a_name_is_the_member_until_it_has_left() {
        let registry = MembershipRegistry::default();
        let mut first = join(&registry, "a", 1).unwrap();
        let mut second = join(&registry, "b", 2).unwrap();
        assert_eq!(first.try_recv().unwrap().unwrap_err().code(), Code::AlreadyExists);
        registry.leave("n", 1);
        assert_eq!(join(&registry, "a", 3).err(), Some(Code::AlreadyExists));
        let mut third = join(&registry, "c", 4).unwrap();
        assert!(second.try_recv().unwrap().is_err());
        assert_eq!(join(&registry, "a", 5).err(), Some(Code::AlreadyExists));
        assert_eq!(join(&registry, "b", 6).err(), Some(Code::AlreadyExists));
        assert!(third.try_recv().is_err(), "it stays");
        registry.leave("n", 4);
        join(&registry, "a", 7).unwrap();
    }

    #[test]
    fn a_process_may_join_again_at_its_address() {
        let registry = MembershipRegistry::default();
        let _first = join(&registry, "a", 1).unwrap();
        let _second = join(&registry, "a", 2).unwrap();
        registry.leave("n", 1);
        assert_eq!(join(&registry, "b", 3).map(drop), Ok(()), "the end of the first is not that of the second");
        assert_eq!(join(&registry, "a", 4).err(), Some(Code::AlreadyExists));
    }
}
