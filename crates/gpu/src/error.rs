//! Errors of the device and of shaders.

/// A fault or limit of the device.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum GpuError {
    #[error("no graphics device found ({0}); on Debian `apt-get install mesa-vulkan-drivers` brings the software one")]
    NoDevice(String),
    #[error("device {name} could not be opened: {reason}")]
    Open { name: String, reason: String },
    #[error("unknown device preference {0:?}, expected any or software")]
    UnknownPreference(String),
    /// A buffer or texture is beyond the device's limits.
    #[error("{what} needs {needed}, the device allows {limit}")]
    Limit { what: String, needed: u64, limit: u64 },
    /// The device failed for all work.
    #[error("device lost or read-back failed: {0}")]
    Lost(String),
    /// The device has no memory for this work.
    #[error("out of device memory: {0}")]
    OutOfMemory(String),
    /// Work that the device does not accept: a fault of this program.
    #[error("the device refused work: {0}")]
    Refused(String),
}

/// A fault of a shader, or of what is bound to it.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum ShaderError {
    #[error("shader template {name}: {source}")]
    Template { name: String, source: minijinja::Error },
    #[error("shader {shader} is invalid: {message}")]
    Invalid { shader: String, message: String },
    /// Resources are not bound as the shader declares them: a fault of this program.
    #[error("shader {shader}, group {group}: {name} {fault}")]
    Binding { shader: String, group: u32, name: String, fault: &'static str },
}

impl GpuError {
    /// Refuses what is beyond a limit.
    ///
    /// # Errors
    /// [`GpuError::Limit`] with the name and both numbers.
    pub fn check_limit(what: &str, needed: u64, limit: u64) -> Result<(), Self> {
        if needed <= limit { Ok(()) } else { Err(Self::Limit { what: what.to_owned(), needed, limit }) }
    }
}
