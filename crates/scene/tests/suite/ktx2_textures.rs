//! `KHR_texture_basisu`: KTX2 textures of Basis Universal.

use scene::{Limits, MissingTextures, Scene, SceneError, SceneErrorKind, load_file};

use crate::samples::ktx2::{etc1s, uastc, uastc_of_encoder, zstandard};
use crate::samples::{Sample, cube, within_a_second};

const RED: [u8; 4] = [250, 10, 20, 255];
const BLUE: [u8; 4] = [1, 2, 240, 128];

/// A cube whose material has a texture of `bytes`.
fn sample(bytes: &[u8]) -> Sample {
    let cube = cube(|c| {
        c.primitive = r#"{"attributes":{"POSITION":0},"indices":1,"material":0}"#.into();
        c.more = r#""extensionsRequired":["KHR_texture_basisu"],"images":[{"uri":"a.ktx2"}],"textures":
            [{"extensions":{"KHR_texture_basisu":{"source":0}}}],
            "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"#
            .into();
    });
    Sample::new("a.glb", &cube.glb()).with("a.ktx2", bytes)
}

fn loaded(bytes: &[u8]) -> Result<Scene, SceneError> {
    sample(bytes).load()
}

#[test]
fn uastc_is_read_plain_and_in_zstandard() {
    for bytes in [uastc(6, 3, &[RED, BLUE]), zstandard(6, 3, &[RED, BLUE], None)] {
        let scene = loaded(&bytes).unwrap();
        let texture = &scene.textures[0];
        assert_eq!((texture.width_px, texture.height_px, texture.is_srgb), (6, 3, true));
        let row = [RED, RED, RED, RED, BLUE, BLUE].concat();
        assert_eq!(texture.srgba8, row.repeat(3));
    }
}

#[test]
fn pictures_of_the_reference_encoder_have_its_colours() {
    // The reference decodes the same texels from ETC1S, which keeps fewer colours.
    let etc1s_colors = [[249, 10, 18, 255], [10, 200, 26, 255], [21, 29, 244, 128]];
    let uastc_colors = [[250, 10, 20, 255], [10, 200, 30, 255], [20, 30, 240, 128]];
    for (bytes, colors) in [(etc1s(), etc1s_colors), (uastc_of_encoder(), uastc_colors)] {
        let scene = loaded(&bytes).unwrap();
        let texture = &scene.textures[0];
        assert_eq!((texture.width_px, texture.height_px), (12, 8));
        let row: Vec<u8> = colors.iter().flat_map(|color| color.repeat(4)).collect();
        assert_eq!(texture.srgba8, row.repeat(8));
    }
}

#[test]
fn sizes_are_limited_before_memory_is_allocated() {
    let sample = sample(&uastc(64, 64, &[RED; 256]));
    let refused = |limits: Limits| load_file(&sample.path, &limits, MissingTextures::Refuse).unwrap_err();
    for limits in [
        Limits { texture_side_px: 63, ..Limits::default() },
        Limits { texture_bytes: 64 * 64 * 4 - 1, ..Limits::default() },
    ] {
        let error = refused(limits);
        assert!(matches!(error.kind, SceneErrorKind::TooLarge { .. }), "{error}");
    }
    // A header that claims 16,384² texels, and has the data of one block.
    let mut huge = uastc(4, 4, &[RED]);
    huge[20..28].copy_from_slice(&[0, 64, 0, 0, 0, 64, 0, 0]);
    let error = within_a_second(|| loaded(&huge).unwrap_err().to_string());
    assert!(error.contains("image 0: its KTX2"), "{error}");
    for claimed in [0, 15, 17, 2_000_000_000] {
        let error = loaded(&zstandard(4, 4, &[RED], Some(claimed))).unwrap_err().to_string();
        assert!(error.contains(&format!("claims {claimed} bytes for 1 blocks")), "{error}");
    }
}

#[test]
fn other_contents_are_refused_with_advice() {
    let plain = uastc(4, 4, &[RED]);
    let changed = |at: usize, value: u32| {
        let mut bytes = plain.clone();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        let error = loaded(&bytes).unwrap_err().to_string();
        assert!(error.contains("image 0: its KTX2") && error.contains("ktxdecompress IN OUT"), "{error}");
        error
    };
    assert!(changed(12, 37).contains("Vulkan's format 37"));
    assert!(changed(20, 0).contains("one flat picture"));
    assert!(changed(28, 2).contains("one flat picture"));
    assert!(changed(32, 2).contains("one flat picture"));
    assert!(changed(36, 6).contains("one flat picture"));
    assert!(changed(44, 3).contains("supercompression 3"));
    assert!(changed(116, 0).contains("not Basis Universal"));
    for length in [12, 80, 103, 104, 160, 175] {
        assert!(loaded(&plain[..length]).unwrap_err().to_string().contains("its KTX2"), "{length}");
    }
}
