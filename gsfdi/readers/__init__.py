"""One telemetry format per file; each ends in a frozen `READER`."""
