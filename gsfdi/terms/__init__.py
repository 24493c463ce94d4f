"""One law of physics per file; each ends in a frozen `TERM`."""
