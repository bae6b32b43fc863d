// The pixels that the pass before left undecided, and for each piece of a view how many they are.

struct PixelList { workgroups: u32, y: u32, z: u32, count: u32 }
@group(0) var<storage, read> listed_pixels: array<u32>;
@group(0) var<storage, read> lists: array<PixelList>;
