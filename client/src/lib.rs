//! Thin client library: ask for views, receive frames. Links no wgpu.
