"""One detector per file; each ends in a frozen `DETECTOR`."""
