//! Generated messages and services. Nothing outside this crate names them.
#![allow(missing_docs, unused_qualifications, clippy::all)]

tonic::include_proto!("myriorama.v1");
