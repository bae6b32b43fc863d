// The lamps with a share of their own in samples of light, and how many lamps have one, one for all others included.
struct LampShares { lamps: array<vec4u, 4>, lamp_count: u32 }
