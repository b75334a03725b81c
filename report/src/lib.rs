//! Self-contained reports: one HTML file with SVG plots that opens offline. Knows data only, nothing of robots.
