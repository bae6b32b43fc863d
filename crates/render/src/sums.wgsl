// Planes of what has arrived so far, summed over rays: what a white surface reflects of all lamps and of the
// environment, three planes each, and how many rays reached the environment and each lamp.
const LAMPS: u32 = 0u;
const ENVIRONMENT: u32 = 3u;
const OPEN_TO_ENVIRONMENT: u32 = {{ COLOR_SUMS }};
const OPEN_TO_LAMPS: u32 = OPEN_TO_ENVIRONMENT + 1u;
