//! Image pairs from whole-number formulas: the same bytes on every machine.

/// A reference and a test image of one size.
pub struct Pair {
    pub name: &'static str,
    pub width: usize,
    pub height: usize,
    pub reference: Vec<u8>,
    pub test: Vec<u8>,
}

/// All pairs, in the order of the tables that quote them.
pub fn all() -> Vec<Pair> {
    let small = |name, test: fn(usize, usize) -> [u8; 3]| pair(name, 96, 64, test);
    let large = |name, test: fn(usize, usize) -> [u8; 3]| pair(name, 200, 150, test);
    vec![
        small("noise", |x, y| base(x, y).map_with(noise(x, y), |value, noise| value + noise)),
        large("blur", blurred),
        large("shift", |x, y| base(x + 1, y)),
        small(
            "block",
            |x, y| {
                if (24..56).contains(&x) && (16..40).contains(&y) { base(x + 40, y + 11) } else { base(x, y) }
            },
        ),
        small("colour", |x, y| {
            let [r, g, b] = base(x, y);
            [g, r, b]
        }),
        large("step", |x, y| base(x, y).map(|value| value.saturating_add(1))),
    ]
}

fn pair(name: &'static str, width: usize, height: usize, test: fn(usize, usize) -> [u8; 3]) -> Pair {
    let filled =
        |pixel: fn(usize, usize) -> [u8; 3]| (0..width * height).flat_map(|i| pixel(i % width, i / width)).collect();
    Pair { name, width, height, reference: filled(base), test: filled(test) }
}

/// Gradients, a disc, stripes one to four pixels wide and a dark corner.
fn base(x: usize, y: usize) -> [u8; 3] {
    let gradient = [(x * 2) % 256, (y * 3) % 256, (x + 2 * y) % 256].map(|value| value as u8);
    let dx = x.abs_diff(60);
    let dy = y.abs_diff(30);
    if dx * dx + dy * dy < 20 * 20 {
        [230, (40 + dx * 5) as u8, (20 + dy * 7) as u8]
    } else if x > 100 && (y / (1 + x / 50)).is_multiple_of(2) {
        [250, 250, 245]
    } else if x < 20 && y < 24 {
        gradient.map(|value| value / 8)
    } else {
        gradient
    }
}

/// The mean of 5×5 pixels.
fn blurred(x: usize, y: usize) -> [u8; 3] {
    let around = |at: usize| at.saturating_sub(2)..=at + 2;
    let mut sum = [0_u32; 4];
    for (x, y) in around(y).flat_map(|y| around(x).map(move |x| (x, y))) {
        let [r, g, b] = base(x, y).map(u32::from);
        sum = [sum[0] + r, sum[1] + g, sum[2] + b, sum[3] + 1];
    }
    [0, 1, 2].map(|channel: usize| (sum[channel] / sum[3]) as u8)
}

/// -24 to 24, the same for all channels' bits of one hash.
fn noise(x: usize, y: usize) -> [i32; 3] {
    let mut hash = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
    [0, 1, 2].map(|_| {
        hash ^= hash >> 15;
        hash = hash.wrapping_mul(0x2C1B_3C6D);
        hash ^= hash >> 12;
        (hash % 49) as i32 - 24
    })
}

trait MapWith {
    fn map_with(self, other: [i32; 3], combine: fn(i32, i32) -> i32) -> [u8; 3];
}

impl MapWith for [u8; 3] {
    fn map_with(self, other: [i32; 3], combine: fn(i32, i32) -> i32) -> [u8; 3] {
        std::array::from_fn(|channel| combine(i32::from(self[channel]), other[channel]).clamp(0, 255) as u8)
    }
}
