"""The compiled replay: one kernel runs any combination of terms without compiling for the combination.

Every term's law is compiled once to machine code of one signature and handed to the kernel by its address, so that the
kernel itself is compiled once after installation and loaded from numba's cache ever after.

Between two events (a controller tick, a recorded sample) the joint moves in equal substeps. Within one

1. the linear joint under constant torques is advanced exactly: ``x⁺ = Φ(h) x + Γ(h) w`` with Φ and Γ summed as Taylor
   series of the matrix exponential, whose argument the choice of h keeps below one half;
2. every law is evaluated at the state of the half step, itself advanced by Φ(h/2) under the last substep's torques:
   second order with a single evaluation per substep;
3. dry friction slides at its level up to the instant at which the speed is zero, and is from there on the torque in
   [-level(-), +level(+)] that leaves the least speed at the end of the step (an implicit, set-valued law: it sticks
   exactly, with no velocity threshold); motor and output side are solved together.

State: ``x = [Ω, Ω̇, ε, ε̇]``; a rigid joint keeps ε = 0. Torque inputs ``w`` are the net torque on the motor, reflected
to the output, and on the output.

The kernel takes few and plain arrays, laid out by `gsfdi.replay.layout`, and allocates none.
"""
