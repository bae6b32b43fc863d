//! Speed against accuracy: reports, checks and charts.
