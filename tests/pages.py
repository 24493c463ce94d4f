"""What the tests of pages are made from: verdicts and stories with hostile names and awkward numbers."""

import numpy as np

from gsfdi.reports import Analysis
from gsfdi.reports.reconcile_page import Story
from gsfdi.types import Due, Finding, JointRecord, Level, Problem, Verdict

HOSTILE = (
    "<script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    '=HYPERLINK("http://x")',
    "{{ 7 * 7 }}",
    "a\nb,\"c'",
    "joint ü 日本",
    "not text \udcff",
)


def record(joint: str) -> JointRecord:
    """Twenty seconds with a gap and a value beyond belief."""
    t = np.arange(0.0, 20.0, 0.01)
    position = np.sin(t)
    position[300:320] = np.nan
    return JointRecord(
        robot="<b>arm</b>",
        joint=joint,
        t0_ns=1_790_000_000_123_456_789,
        t=t,
        channels={"setpoint": np.sin(t), "position": position, "motor_current": np.where(t == 5.0, 1e165, np.cos(t))},
        quality={"time": {"gaps": 2}, joint: {joint: 3.0}},
    )


def verdict(joint: str, level: Level = "distress") -> Verdict:
    """A verdict with infinite and missing numbers among its findings."""
    t = np.arange(0.0, 20.0, 0.1)
    cosines = {"torque_constant_drift": 0.97, joint: 0.4}
    findings = (
        Finding("parity", "parity", joint, True, 0.0, np.inf, 4.0, "1", f"residual of {joint}", 7.9, {"t": t, "r": t}),
        Finding(
            "angles", "smi", joint, False, np.nan, np.nan, 0.1, "rad", f"angles of {joint}", None, {joint: cosines}
        ),
    )
    return Verdict(
        joint=joint,
        verdict=level,
        action="none" if level == "normal" else "inspect",
        component="motor",
        fault="torque_constant_drift",
        fault_probability=0.97,
        alternatives=({"fault": joint, "probability": 0.02},),
        onset_s=7.9,
        methods={"parity": {"alarm": True, "p_value": np.float64(0.0)}, "smi": {"alarm": np.False_, "p_value": np.nan}},
        due=Due("2026-12-14", ("2026-12-02", "2027-01-08"), f"because of {joint}"),
        says=f"{joint} loses torque.",
        findings=findings,
    )


def analysis(*joints: str, levels: tuple[Level, ...] = ("distress",)) -> Analysis:
    """An analysis of `joints`, their levels taken in turn."""
    return Analysis(
        batch_path="in/<i>night</i>.mcap",
        batch_sha256="0" * 64,
        baseline_name=None,
        baseline_sha256=None,
        made="2026-11-21T02:00:00+00:00",
        verdicts=tuple(verdict(joint, levels[k % len(levels)]) for k, joint in enumerate(joints)),
        records=tuple(map(record, joints)),
        problems=(Problem("in/<u>bad</u>.csv", "cut short & odd", "record it again"),),
    )


def story(joint: str, outcome: str = "explained") -> Story:
    """A joint that was reconciled, with every kind of evidence."""
    t = np.arange(80.0, 120.0, 0.01)
    current = 0.3 * np.sign(np.sin(0.5 * t)) + 0.5 * np.cos(0.5 * t)
    cells = np.outer(np.sign(np.linspace(-1, 1, 12)), np.ones(20)) * 2.1
    cells[2:4, 3:6] = np.nan
    term = {
        "term": "coulomb_friction",
        "component": "friction",
        "side": "motor",
        "probability": 0.98,
        "parameters": {"torque_nm": {"value": 2.1, "ci95": [2.0, 2.2]}},
        "says": f"Dry friction of {joint}.",
    }
    described = {
        "joint": joint,
        "verdict": outcome,
        "mismatch": {"detected": True, "p_value": 1e-9, "effect": 0.94},
        "location": {
            "component": "friction",
            "signals": ["motor_current_a"],
            "where": [{"covariate": "motor_velocity_rad_s", "low": -0.1, "high": 0.1, "share_of_misfit": 0.83}],
            "when": [{"from_s": 7.4, "to_s": 60.0}],
            "bands_hz": [[0.0, 2.0]],
        },
        "omitted_physics": [term] if outcome == "explained" else [],
        "indistinguishable": [["torque_constant_change", "output_inertia_change"]],
        "fit": {
            "held_out_seconds": [80.0, 120.0],
            "before": {"motor_current_a": 0.031, "position_rad": 2.1e-4},
            "after": {"motor_current_a": 0.002, "position_rad": None},
            "noise_floor": {"motor_current_a": 0.0019},
        },
        "updated_model": None,
    }
    evidence = {
        "overlays": [
            {"name": "motor_current_a", "t": t, "recorded": current, "before": current - 0.3, "after": current}
        ],
        "maps": [
            {
                "title": "Residual torque",
                "x": "position_rad",
                "y": "motor_velocity_rad_s",
                "x_edges": np.linspace(-1, 1, 21),
                "y_edges": np.linspace(-30, 30, 13),
                "before": cells,
                "after": 0 * cells,
            }
        ],
        "profiles": [{"covariate": "position_rad", "unknown": "torque_nm", "at": t, "before": current, "after": None}],
        "ranking": [
            {"term": "coulomb_friction", "side": "motor", "probability": 0.98, "why": "fits"},
            {"term": joint, "probability": 0.01, "why": f"why {joint} lost"},
        ],
        "experiments": [f"Move {joint} with a known load."],
    }
    return Story(described, evidence, f'[joint]\nname = "{joint}"\n')


def rate(hits: int, of: int) -> dict[str, object]:
    """A rate as a proof gives it."""
    return {"hits": hits, "of": of, "rate": hits / of if of else None, "ci95": [0.9 * hits / max(of, 1), 1.0]}


def proof(kinds: tuple[str, ...] = HOSTILE, each: int = 4) -> dict[str, object]:
    """A proof of invented figures: some goals kept, some missed, some questions that never arose."""
    scores, confusion = {}, {}
    for i, kind in enumerate(kinds):
        for k in range(each):
            right = (i + k) % 5 != 0
            scores[f"case-{i * each + k:03d}"] = {
                "group": "single" if i else "null",
                "kinds": [kind] if i else [],
                "size": "plain",
                "visible": k != 3,
                "first_right": right if i else None,
                "extra": [],
                "puzzled": False,
                "verdict": "explained",
                "named": [kind if right else "coulomb_friction"],
                "seconds": 1.5,
                "concealment": {"tracking": 10.0 ** -(k + 1), "effort": 3.0**k, "windup": 0.0} if i else None,
            }
        confusion[kind] = {kind: each - 1, kinds[i - 1]: 1, "(no_mismatch)": 1}
    row = {"size": "plain", "cases": each, "visible": 3, "first_right": 3, "covered": 4, "located": 4, "puzzled": 0}
    figures = {
        "cases": len(scores),
        "trespasses": 0,
        "first_name_right": rate(96, 100),
        "located_right": rate(90, 100),
        "false_discovery_in_nulls": rate(0, 100),
        "several_all_named": rate(0, 0),
        "parameter_error_median": 0.021,
        "parameter_coverage": rate(93, 100),
        "below_detection_silent_or_right": rate(9, 9),
        "fit": {"motor_current_a": {"cases": 80, "before_over_oracle": 31.0, "after_over_oracle": 1.04}},
        "seconds_median": 2.0,
        "seconds_most": 9.0,
    }
    return {
        "schema": "gsfdi/proof/1",
        "seal": {"truth_sha256": "ab" * 32, "answers_sha256": "cd" * 32, "answers": {}},
        "figures": figures,
        "kinds": [{**row, "kind": kind, "silent": 0, "tracking": 0.004, "effort": 31.0} for kind in kinds],
        "confusion": confusion,
        "scores": scores,
        "calibration": [{"from": 0.9, "to": 0.99, "said": 0.95, **rate(18, 20)}],
        "rivals": {f"least squares {kinds[0]}": {"first_name_right": rate(40, 100)}},
        "real": [{"recording": "emps", "withheld": "viscous_friction", "named": kinds[-1], "right": False}],
        "showcase": {
            "title": "The position looks perfect",
            "says": f"Nothing to see in the position of {kinds[0]}.",
            "truth": kinds[1],
            "overlays": story("SH1").evidence["overlays"],
        },
    }
