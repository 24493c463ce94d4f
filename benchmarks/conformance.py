"""Every file of the MCAP project's conformance suite, read; its messages counted against the suite's own account."""

import json
import os
import sys
from pathlib import Path

from gsfdi import ingest
from gsfdi.readers.mcap_file import message_counts

REAL = Path(os.environ.get("GSFDI_REAL", Path(__file__).parents[2] / "shared" / "real"))


def run(folder: Path) -> dict[str, int]:
    score = {"files": 0, "read": 0, "with messages": 0, "counts right": 0, "found damaged": 0}
    for path in sorted(folder.rglob("*.mcap")):
        records = json.loads(path.with_suffix(".json").read_text())["records"]
        stated = sum(record["type"] == "Message" for record in records)
        score["files"] += 1
        batch = ingest.read([path])
        score["read"] += 1
        score["found damaged"] += any(problem.kind == "damaged" for problem in batch.problems)
        score["with messages"] += stated > 0
        score["counts right"] += stated > 0 and message_counts(path).total() == stated
    return score


if __name__ == "__main__":
    score = run(REAL / "mcap-conformance")
    if not score["files"]:
        sys.exit(f"no conformance files under {REAL}; set GSFDI_REAL")
    (Path(__file__).parent / "results" / "conformance.json").write_text(json.dumps(score, indent=1) + "\n")
    print(json.dumps(score, indent=1))
