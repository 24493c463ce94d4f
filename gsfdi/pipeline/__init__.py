"""The order of the stages: one file per command, from paths to an `Outcome`.

Each file imports what its command needs and no more, so that ``gsfdi ingest`` does not wait for a simulator to load.
"""
