"""Imports point down: ground, shelves, stages, then config, pipeline, cli."""

import ast
from pathlib import Path

import pytest

import gsfdi

HOME = Path(gsfdi.__file__).parent
GROUND = (
    "errors",
    "channels",
    "types",
    "mapping",
    "canonical",
    "wire",
    "registry",
    "toml_lines",
    "svg",
    "joint",
    "subspace",
    "stretches",
    "observer",
    "whiten",
    "directions",
    "nominal",
    "clock",
    "passes",
    "quality",
    "assemble",
    "motion",
    "bristle",
    "sliding",
    "wave",
    "scales",
    "model",
    "replay",
    "atomic",
    "canonical_mcap",
    "seal",
    "student",
    "heap",
)
SHELVES = ("readers", "terms", "detectors", "reports")
STAGES = (
    "parts",
    "store",
    "ingest",
    "healthy",
    "baseline",
    "diagnosis",
    "prognosis",
    "modelfile",
    "packed",
    "starting",
    "fault",
    "drive",
    "training",
    "telemetry",
    "simulate",
    "fit",
    "reconcile",
    "proof",
)
TOP = ("config", "options", "console", "workers", "overview", "pipeline", "nightly", "cli", "__main__")
FLOORS = (GROUND, SHELVES, STAGES, TOP)
FLOOR = {name: height for height, rooms in enumerate(FLOORS) for name in rooms}


def imports(path: Path) -> set[str]:
    """Rooms of gsfdi that the file imports, wherever in the file."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            whole = node.module != "gsfdi"
            names = [str(node.module) if whole else f"gsfdi.{alias.name}" for alias in node.names]
        found |= {name.split(".")[1] for name in names if name.startswith("gsfdi.")}
    return found - {"__version__"}


@pytest.mark.parametrize("path", sorted(HOME.rglob("*.py")), ids=lambda path: str(path.relative_to(HOME)))
def test_imports_point_down(path: Path) -> None:
    room = path.relative_to(HOME).parts[0].removesuffix(".py")
    if room == "__init__":
        return
    for other in imports(path) - {room}:
        assert FLOOR[other] <= FLOOR[room], f"{room} imports {other} from above"
        assert not (room in SHELVES and other in SHELVES), f"shelf {room} imports shelf {other}"
