//! KTX2 pictures of Basis Universal: of UASTC blocks, written by hand, and two by the encoder of Basis Universal 2.10.

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

/// Three squares of 4×8 texels beside each other, of the colours (250, 10, 20, 255), (10, 200, 30, 255) and (20, 30, 240, 128):
/// ETC1S in BasisLZ, with alpha, from `basisu` of quality 90.
pub fn etc1s() -> Vec<u8> {
    bytes_from_hex(ETC1S)
}

/// The same squares: UASTC in Zstandard of level 9.
pub fn uastc_of_encoder() -> Vec<u8> {
    bytes_from_hex(UASTC)
}

fn bytes_from_hex(text: &str) -> Vec<u8> {
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    text.as_bytes().chunks(2).map(byte).collect()
}

const ETC1S: &str = "\
    ab4b5458203230bb0d0a1a0a00000000010000000c000000080000000000000000000000010000000100000001000000680000003c000000\
    a400000024000000c8000000000000008f000000000000005701000000000000030000000000000000000000000000003c00000000000000\
    02003800a301020003030000080800000000000000003f000000000000000000ffffffff40003f0f0000000000000000ffffffff1f000000\
    4b545877726974657200426173697320556e6976657273616c20322e313000000500010034000000050000002e0000000000000000000000\
    000000000200000002000000010000001e40c4800000006090ae185313c084000100000010f420c808600a80000000200c038d2f4300a600\
    0000000040202d6a7da09f035455555505e0c0440000000000100431e0e81100130004000000209023044c040000000000206d0880190000\
    0000000024000107000d";

const UASTC: &str = "\
    ab4b5458203230bb0d0a1a0a00000000010000000c000000080000000000000000000000010000000100000002000000680000002c000000\
    940000002400000000000000000000000000000000000000b8000000000000002d0000000000000060000000000000002c00000000000000\
    02002800a601020003030000100000000000000000007f030000000000000000ffffffff1f0000004b545877726974657200426173697320\
    556e6976657273616c20322e3130000028b52ffd2060250100b8575f81e27ffa62005701d9e37f129997c2031ef022e50304004d1501207c\
    663104e002";
