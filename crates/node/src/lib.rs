//! What every service shares: configuration, logging, health, measured costs, drain.
