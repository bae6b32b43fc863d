//! One process a member: which one it is, and how its membership is ended.

use std::collections::{HashMap, HashSet};
use std::sync::{Mutex, MutexGuard, PoisonError};

use cluster::limits::MAX_NODES;
use cluster::{NodeStatus, Welcome};
use tokio::sync::mpsc;
use tonic::Status;

/// What a member is told. Room for a welcome and an end.
type Says = mpsc::Sender<Result<Welcome, Status>>;
pub(crate) type Told = mpsc::Receiver<Result<Welcome, Status>>;

struct Seat {
    incarnation: u64,
    address: String,
    says: Says,
    /// Processes of this name that came before, and may not take it back while this one is here.
    replaced: HashSet<String>,
}

/// Members by name. Of two processes with one name the later counts; the earlier waits until that one has left, or they
/// would replace each other for ever.
#[derive(Default)]
pub(crate) struct Seats(Mutex<HashMap<String, Seat>>);

impl Seats {
    fn locked(&self) -> MutexGuard<'_, HashMap<String, Seat>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Seats a node; a process that has its name is told to leave.
    pub(crate) fn take(&self, node: &NodeStatus, incarnation: u64, welcome: Welcome) -> Result<Told, Status> {
        let mut seats = self.locked();
        if seats.len() >= MAX_NODES && !seats.contains_key(&node.node_name) {
            return Err(Status::resource_exhausted(format!("node_name: there are {MAX_NODES} nodes")));
        }
        let mut replaced = HashSet::new();
        if let Some(before) = seats.get(&node.node_name).filter(|before| before.address != node.address) {
            if before.replaced.contains(&node.address) {
                return Err(taken(&node.node_name, &before.address));
            }
            replaced.extend(before.replaced.iter().cloned().chain([before.address.clone()]));
        }
        let (says, told) = mpsc::channel(2);
        let _ = says.try_send(Ok(welcome));
        let seat = Seat { incarnation, address: node.address.clone(), says, replaced };
        if let Some(before) = seats.insert(node.node_name.clone(), seat) {
            let _ = before.says.try_send(Err(taken(&node.node_name, &node.address)));
        }
        Ok(told)
    }

    /// The membership has ended.
    pub(crate) fn leave(&self, node_name: &str, incarnation: u64) {
        let mut seats = self.locked();
        if seats.get(node_name).is_some_and(|seat| seat.incarnation == incarnation) {
            seats.remove(node_name);
        }
    }

    /// Who has the name now.
    pub(crate) fn incarnation(&self, node_name: &str) -> Option<u64> {
        self.locked().get(node_name).map(|seat| seat.incarnation)
    }

    /// Ends a membership, if it is still the same; the node may join again.
    pub(crate) fn end(&self, node_name: &str, incarnation: u64, why: &str) {
        let mut seats = self.locked();
        if seats.get(node_name).is_some_and(|seat| seat.incarnation == incarnation)
            && let Some(seat) = seats.remove(node_name)
        {
            let _ = seat.says.try_send(Err(Status::aborted(why)));
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

    fn take(seats: &Seats, address: &str, incarnation: u64) -> Result<Told, Code> {
        let mut told = seats.take(&node(address), incarnation, Welcome::default()).map_err(|status| status.code())?;
        assert_eq!(told.try_recv().unwrap().unwrap(), Welcome::default());
        Ok(told)
    }

    #[test]
    fn the_later_counts_and_the_earlier_waits_until_it_has_left() {
        let seats = Seats::default();
        let mut first = take(&seats, "a", 1).unwrap();
        let mut second = take(&seats, "b", 2).unwrap();
        assert_eq!(first.try_recv().unwrap().unwrap_err().code(), Code::AlreadyExists);
        seats.leave("n", 1);
        assert_eq!(take(&seats, "a", 3).err(), Some(Code::AlreadyExists));
        let mut third = take(&seats, "c", 4).unwrap();
        assert!(second.try_recv().unwrap().is_err());
        assert_eq!(take(&seats, "a", 5).err(), Some(Code::AlreadyExists));
        assert_eq!(take(&seats, "b", 6).err(), Some(Code::AlreadyExists));
        assert!(third.try_recv().is_err(), "it stays");
        seats.leave("n", 4);
        take(&seats, "a", 7).unwrap();
    }

    #[test]
    fn a_process_may_join_again_where_it_is() {
        let seats = Seats::default();
        let _first = take(&seats, "a", 1).unwrap();
        let _again = take(&seats, "a", 2).unwrap();
        let mut third = take(&seats, "a", 3).unwrap();
        seats.end("n", 2, "of before");
        assert_eq!(seats.incarnation("n"), Some(3));
        seats.end("n", 3, "because");
        assert_eq!(third.try_recv().unwrap().unwrap_err().message(), "because");
        assert_eq!(seats.incarnation("n"), None);
    }
}
