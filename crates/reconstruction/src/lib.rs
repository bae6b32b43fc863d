//! Reconstruction methods: depth images to views.
