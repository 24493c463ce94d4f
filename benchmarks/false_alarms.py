"""How often fault-free telemetry raises a verdict, against the rate that was promised.

At the promised 0.1 per joint and year nothing would be seen in an hour of simulation; so the promise is raised to
whole percents per batch, where a few hundred batches tell, and the tail beyond is looked at through the p-values.
Motions, noise and joints differ from batch to batch; the baseline is learnt from others.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from gsfdi.baseline import learn_joint
from gsfdi.diagnosis import Limits, assess
from gsfdi.model import JointModel
from gsfdi.modelfile import load_models
from gsfdi.simulate import fault_of, simulate_record

HOME = Path(__file__).parent
RESULTS = HOME / "results" / "false_alarms.json"


def joints() -> dict[str, JointModel]:
    """The paper's joint as it is, with friction, and with ripple and cogging besides; all of it fault-free."""
    plain = load_models(HOME.parent / "configs" / "era_joint.toml").for_joint("era-joint")
    rough = (fault_of("coulomb_friction=2"), fault_of("viscous_friction=40"))
    return {
        "linear": plain,
        "with friction": replace(plain, physics=rough),
        "with friction, ripple, cogging": replace(
            plain, physics=(*rough, fault_of("torque_ripple=0.01"), fault_of("cogging=0.3"))
        ),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--batches", type=int, default=150, help="fault-free batches per joint")
    parser.add_argument("--seed", type=int, default=0, help="first of the seeds that everything is drawn from")
    parser.add_argument("--duration", type=float, default=60.0, help="seconds of each")
    given = parser.parse_args()
    promises = (0.1 / 365.0, 0.01, 0.05)
    kept: dict[str, dict[str, object]] = {}
    for name, model in joints().items():
        nominal = replace(model, physics=())
        known = learn_joint(
            [simulate_record(model, seed=given.seed + s, duration=given.duration) for s in range(6)], nominal
        )
        batches = [
            simulate_record(model, seed=given.seed + 1000 + s, duration=given.duration) for s in range(given.batches)
        ]
        row: dict[str, object] = {}
        for promise in promises:
            limits = Limits(false_alarms_per_joint_year=promise * 365.0)
            verdicts = [assess(one, known, limits=limits) for one in batches]
            alarms = [one for one in verdicts if one.verdict != "normal"]
            row[f"{promise:.2g}"] = len(alarms) / len(batches)
            serious = sum(one.verdict in ("distress", "critical") for one in verdicts)
            print(f"{name:32s} promised {promise:8.2g}  had {len(alarms):3d} of {len(batches)}, serious {serious}")
        least = {}
        for verdict in verdicts:
            for finding in verdict.findings:
                least.setdefault(finding.detector, []).append(finding.p_value)
        row["smallest p by detector"] = {key: float(np.min(values)) for key, values in least.items()}
        kept[name] = row
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps(kept, indent=1) + "\n")


if __name__ == "__main__":
    main()
