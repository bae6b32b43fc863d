// Owen-scrambled Sobol points in two dimensions (Sobol 1967; Owen 1995; hashed as by Laine and Karras 2011 and
// Burley 2020): any first 2^n of them are stratified in every way, so that they may be taken in parts.

fn hashed(value: u32) -> u32 {
    var h = value * 747796405u + 2891336453u;
    h = ((h >> ((h >> 28u) + 4u)) ^ h) * 277803737u;
    return (h >> 22u) ^ h;
}

// Owen's scramble of a number whose digits stand the other way round.
fn scrambled(digits: u32, seed: u32) -> u32 {
    var x = digits ^ (digits * 0x3d20adeau);
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// The second dimension's digits: digit i is the parity of the index's bits whose place contains i's bits.
fn second_digits(index: u32) -> u32 {
    var x = index;
    x ^= (x >> 1u) & 0x55555555u;
    x ^= (x >> 2u) & 0x33333333u;
    x ^= (x >> 4u) & 0x0f0f0f0fu;
    x ^= (x >> 8u) & 0x00ff00ffu;
    x ^= (x >> 16u) & 0x0000ffffu;
    return x;
}

fn unit_fraction(digits: u32) -> f32 { return f32(reverseBits(digits) >> 8u) * 5.9604645e-8; }

// The `number`-th point of the sequence of `seed`.
fn point_of(number: u32, seed: u32) -> vec2f {
    let index = reverseBits(scrambled(reverseBits(number), seed));
    let first = scrambled(index, hashed(seed ^ 0x9e3779b9u));
    let second = scrambled(second_digits(index), hashed(seed ^ 0x7f4a7c15u));
    return vec2f(unit_fraction(first), unit_fraction(second));
}
