//! The standard reflection service (v1): the names and descriptions of services and messages.

use tonic_reflection::server::v1::{ServerReflection, ServerReflectionServer};
use tonic_reflection::server::{Builder, Error};

const DESCRIPTORS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/descriptors.bin"));

/// The service, ready to be added to a server.
///
/// # Errors
/// Where the descriptors that this crate was built with cannot be read.
pub fn reflection_server() -> Result<ServerReflectionServer<impl ServerReflection>, Error> {
    let builder = Builder::configure().register_encoded_file_descriptor_set(DESCRIPTORS);
    builder.register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET).build_v1()
}

#[cfg(test)]
mod tests {
    use tokio::net::TcpListener;
    use tokio_stream::StreamExt as _;
    use tonic::transport::Server;
    use tonic::transport::server::TcpIncoming;
    use tonic_reflection::pb::v1::server_reflection_client::ServerReflectionClient;
    use tonic_reflection::pb::v1::server_reflection_request::MessageRequest;
    use tonic_reflection::pb::v1::server_reflection_response::MessageResponse;
    use tonic_reflection::pb::v1::{ServerReflectionRequest, ServerReflectionResponse};

    use super::*;
    use crate::rpc::connect;

    async fn ask(address: &str, request: MessageRequest) -> ServerReflectionResponse {
        let mut client = ServerReflectionClient::new(connect(address).await.unwrap());
        let request = ServerReflectionRequest { host: String::new(), message_request: Some(request) };
        let answers = client.server_reflection_info(tokio_stream::once(request)).await.unwrap();
        answers.into_inner().next().await.unwrap().unwrap()
    }

    #[tokio::test]
    async fn every_service_is_listed_and_described() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = format!("http://{}", listener.local_addr().unwrap());
        let server = Server::builder().add_service(reflection_server().unwrap());
        let serving = tokio::spawn(server.serve_with_incoming(TcpIncoming::from(listener)));
        let answer = ask(&address, MessageRequest::ListServices(String::new())).await;
        let Some(MessageResponse::ListServicesResponse(list)) = answer.message_response else { panic!("{answer:?}") };
        let names: Vec<String> = list.service.into_iter().map(|service| service.name).collect();
        for service in ["Coordinator", "Node", "Sampler", "Compositor"] {
            let name = format!("myriorama.v1.{service}Service");
            assert!(names.contains(&name), "{name} in {names:?}");
            let answer = ask(&address, MessageRequest::FileContainingSymbol(name)).await;
            assert!(matches!(answer.message_response, Some(MessageResponse::FileDescriptorResponse(_))), "{answer:?}");
        }
        assert!(names.contains(&"grpc.health.v1.Health".to_owned()), "{names:?}");
        serving.abort();
    }
}
