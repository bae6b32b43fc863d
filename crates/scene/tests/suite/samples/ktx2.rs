//! KTX2 pictures of Basis Universal, written by hand.

/// A picture of UASTC blocks, each of one colour, row by row.
pub fn uastc(width_px: u32, height_px: u32, blocks: &[[u8; 4]]) -> Vec<u8> {
    assert_eq!(blocks.len() as u32, width_px.div_ceil(4) * height_px.div_ceil(4));
    // The mode of one colour has the code 10111, lowest bit first; the colour follows.
    let block = |&rgba: &[u8; 4]| (0b10111 | u128::from(u32::from_le_bytes(rgba)) << 5).to_le_bytes();
    let level: Vec<u8> = blocks.iter().flat_map(block).collect();
    let length = level.len();
    container(width_px, height_px, 0, &level, length)
}

/// The picture of [`uastc`] in a frame of Zstandard, whose block is not compressed. The header claims `claimed_bytes`.
pub fn zstandard(width_px: u32, height_px: u32, blocks: &[[u8; 4]], claimed_bytes: Option<usize>) -> Vec<u8> {
    let plain = uastc(width_px, height_px, blocks).split_off(160);
    let length = plain.len() as u32;
    let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0xa0];
    frame.extend(length.to_le_bytes());
    frame.extend(&(length << 3 | 1).to_le_bytes()[..3]);
    frame.extend(&plain);
    container(width_px, height_px, 2, &frame, claimed_bytes.unwrap_or(plain.len()))
}

fn container(width_px: u32, height_px: u32, scheme: u32, level: &[u8], decoded_bytes: usize) -> Vec<u8> {
    let mut bytes = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
    let words = |bytes: &mut Vec<u8>, words: &[u32]| bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    // Format, type size, size, depth, layers, faces, levels, scheme; then descriptor, and no data of keys or codebooks.
    words(&mut bytes, &[0, 1, width_px, height_px, 0, 0, 1, 1, scheme, 104, 44, 0, 0, 0, 0, 0, 0]);
    words(&mut bytes, &[160, 0, level.len() as u32, 0, decoded_bytes as u32, 0]);
    // UASTC, sRGB, blocks of 4×4 texels and 16 bytes, one sample of RGBA.
    words(
        &mut bytes,
        &[44, 0, 40 << 16 | 2, 2 << 16 | 1 << 8 | 166, 0x0303, 16, 0, 3 << 24 | 127 << 16, 0, 0, u32::MAX],
    );
    bytes.resize(160, 0);
    bytes.extend(level);
    bytes
}
