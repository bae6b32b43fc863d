//! The wire contract: generated messages, domain conversions, the depth codec and the frame codec.
