"""Logs slower than their controller: the joint of the paper with one effect left out, or none, in a faster loop.

``python benchmarks/thinned.py [--loop 1000] [--stride 10] [--seconds 60] [--first 100]`` prints what each log of every
`stride`-th sample is said to lack.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

from gsfdi.model import TermUse
from gsfdi.modelfile import load_models
from gsfdi.reconcile import reconcile
from gsfdi.simulate import simulate_record

ERA = Path(__file__).resolve().parents[1] / "configs" / "era_joint.toml"
LEFT_OUT = (
    None,
    None,
    TermUse("coulomb_friction", {"torque_nm": 4.0}),
    TermUse("stribeck_friction", {"excess_nm": 10.0}),
    TermUse("presliding_friction", {"torque_nm": 10.0}),
    TermUse("viscous_friction", {"coefficient_nms_rad": 30.0}),
    TermUse("cogging", {"amplitude_nm": 0.05}),
    TermUse("actuation_delay", {"delay_s": 0.02}),
    TermUse("torque_constant_change", {"ratio": 0.8}, onset=20.0),
    TermUse("stiffness_change", {"ratio": 0.9}),
    TermUse("backlash", {"half_width_rad": 2e-4}),
    TermUse("gearbox_hysteresis", {"torque_nm": 20.0}),
    TermUse("constant_load", {"torque_nm": 10.0}),
    TermUse("output_inertia_change", {"ratio": 1.3}),
    TermUse("velocity_lag", {"lag_s": 0.005}),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--loop", type=float, default=1000.0, help="ticks of the controller per second")
    parser.add_argument("--stride", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--first", type=int, default=100, help="seed of the first joint")
    given = parser.parse_args()
    model = load_models(ERA).for_joint("joint")
    assert model.controller is not None
    model = replace(model, controller=replace(model.controller, sample_rate=given.loop))
    alone = 0
    for seed, use in enumerate(LEFT_OUT, start=given.first):
        made = simulate_record(model, faults=[use] if use else [], duration=given.seconds, seed=seed)
        channels = {name: made[name][:: given.stride] for name in made.channels}
        record = replace(made, t=made.t[:: given.stride], channels=channels, valid={})
        begun = time.process_time()
        found = reconcile([record], model)
        named = [entry["term"] for entry in found.omitted_physics]
        alone += named == ([use.term] if use else [])
        took = time.process_time() - begun
        print(f"{seed} {use.term if use else '-'}: {found.verdict} by {', '.join(named)}, {took:.1f} s", flush=True)
    print(f"named rightly and alone: {alone} of {len(LEFT_OUT)}")


if __name__ == "__main__":
    main()
