//! Work of devices and codecs, away from the threads that serve connections.

use tonic::Status;

/// Runs `work` on a blocking thread.
///
/// # Errors
/// The work's own; `INTERNAL` where it panicked.
pub async fn blocking<T: Send + 'static, E: Into<Status> + Send + 'static>(
    work: impl FnOnce() -> Result<T, E> + Send + 'static,
) -> Result<T, Status> {
    match tokio::task::spawn_blocking(work).await {
        Ok(result) => result.map_err(Into::into),
        Err(error) => Err(Status::internal(format!("work failed: {error}"))),
    }
}
