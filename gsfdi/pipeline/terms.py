"""``gsfdi terms``: the shelf of physics and faults, listed or explained."""

from collections.abc import Sequence
from typing import Any

from gsfdi.errors import UnusableInputError, nearest
from gsfdi.modelfile import terms as shelf_of_terms
from gsfdi.motion import PhysicsTerm
from gsfdi.pipeline.outcome import Outcome
from gsfdi.pipeline.sketch import sketch


def terms(names: Sequence[str]) -> Outcome:
    """List every term, or explain some.

    Parameters
    ----------
    names : sequence of str
        Terms to explain; none for a list of all.
    """
    known = shelf_of_terms()
    for name in names:
        if name not in known:
            raise UnusableInputError(name, "no term of physics is called that", nearest(name, known))
    chosen = (
        [known[name] for name in names] if names else sorted(known.values(), key=lambda one: (one.component, one.name))
    )
    result = {"schema": "gsfdi/terms/1", "terms": [facts(term) for term in chosen]}
    lines = [line for term in chosen for line in explained(term)] if names else table(chosen)
    return Outcome(result, lines)


def facts(term: PhysicsTerm) -> dict[str, Any]:
    """What a program may want to know of a term.

    Parameters
    ----------
    term : PhysicsTerm
        One of the shelf.
    """
    return {
        "term": term.name,
        "component": term.component,
        "meaning": term.meaning,
        "maintenance": term.maintenance,
        "source": term.source,
        "sides": list(term.sides),
        "structures": list(term.structures),
        "dissipative": term.dissipative,
        "memory": term.memory,
        "parameters": [
            {
                "name": param.name,
                "unit": param.unit,
                "meaning": param.meaning,
                "low": param.low,
                "high": param.high,
                "start": param.start,
            }
            for param in term.params
        ],
    }


def table(chosen: Sequence[PhysicsTerm]) -> list[str]:
    """One line per term, by component.

    Parameters
    ----------
    chosen : sequence of PhysicsTerm
        Sorted by component.
    """
    wide = max(len(term.name) for term in chosen)
    lines = []
    for number, term in enumerate(chosen):
        if number == 0 or term.component != chosen[number - 1].component:
            lines.append(f"{term.component}")
        lines.append(f"  {term.name:{wide}}  {', '.join(param.name for param in term.params)}")
    return lines


def explained(term: PhysicsTerm) -> list[str]:
    """Explain one term in full, with a sketch of its law.

    Parameters
    ----------
    term : PhysicsTerm
        One of the shelf.
    """
    traits = [
        *([f"sits on the {' or the '.join(term.sides)} side"] if term.sides else []),
        f"in {' and '.join(term.structures)} joints",
        *(["only takes energy out"] if term.dissipative else []),
        *(["has memory"] if term.memory else []),
    ]
    wide = max(len(param.name) for param in term.params)
    example = f"--fault {term.name}={term.params[0].start:g}"
    return [
        f"{term.name} ({term.component}): {term.meaning}",
        *(
            f"  {param.name:{wide}}  [{param.unit or '1'}] {param.meaning}, {param.low:g} to {param.high:g}"
            for param in term.params
        ),
        f"  {'; '.join(traits)}",
        f"  maintenance: {term.maintenance}",
        f"  source: {term.source}",
        f"  try: gsfdi simulate --model M.toml {example} --out sample.parquet",
        *("  " + line for line in sketch(term)),
        "",
    ]
