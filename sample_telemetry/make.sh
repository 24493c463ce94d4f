#!/bin/sh
# Makes the telemetry beside this file: four fault-free batches of the arm, and a night with three faults in it.
# The same seeds give the same bytes.
set -eu
cd "$(dirname "$0")"
simulate() { gsfdi simulate --quiet --model ../configs/era_arm.toml --duration 40 "$@"; }

mkdir -p healthy night
for batch in 1 2 3 4; do
  simulate --seed "$batch" --out "healthy/batch-$batch.parquet"
done

# Four joints as they should be, and the paper's fault: from 7.5 s on the motor loses 1 % of its torque a second.
simulate --seed 11 --joint SH1 --joint WR1 --joint WR3 --joint EE --out night/arm.parquet
simulate --seed 12 --joint SH2 --fault torque_constant_drift=-0.01@7.5 --out night/SH2.mcap
simulate --seed 13 --joint EL --fault stiffness_change=0.9@20 --out night/EL.parquet
simulate --seed 14 --joint WR2 --fault coulomb_friction=1.5 --out night/WR2.parquet
