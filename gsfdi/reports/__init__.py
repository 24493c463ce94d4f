"""One form of report per file; each ends in a frozen `REPORT`."""
