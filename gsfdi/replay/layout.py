"""Where each number stands in the arrays that the kernel takes and gives."""

CLOSED_LOOP, OPEN_LOOP, PREDICT, PREDICT_CONTROLLER = range(4)

# Slots in which laws act.
TORQUE_CONSTANT, CURRENT, DELAY, MOTOR_TORQUE, OUTPUT_TORQUE, MOTOR_DRY, OUTPUT_DRY = range(7)
WINDUP, SPRING, POSITION_SENSOR, VELOCITY_SENSOR, CURRENT_SENSOR, LATENCY, SPEED_LATENCY, SLOTS = range(7, 15)

# A packed model: controller, step, where each slot's terms begin; then a row per era and a row per term.
KP, KI, KD, RATE_FEEDFORWARD, LIMIT, SPEED_AGE, LONGEST_STEP, WAVE, GEAR, RIGID = range(10)
SLOW, TURN_RATE, PLAY, SIDED, ERAS, FIRST = range(10, 16)
ERA_ROWS = FIRST + SLOTS + 1
INERTIA_MOTOR, INERTIA_OUTPUT, SPRING_RATE, DAMPING, DRIVE_GAIN, FROM_TIME, ERA_WIDTH = range(7)
ADDRESS, ONSET, PARAMS, TERM_WIDTH = 0, 1, 2, 6

# A row of the clock: what an event brings. RECORD is the number of the sample, -1 where the event is a tick only;
# RESTART the row of the state to restart from, else -1; LEVER the speed per effort where that told the speed, else 0.
TIME, TICK, RECORD, RESTART, SETPOINT, RATE, FEEDFORWARD, EFFORT = range(8)
POSITION, VELOCITY, TEMPERATURE, LEVER, EVENT_WIDTH = range(8, 13)

# A row of the states, by event: motion, the integral part of the controller, the effort that flows, and the motor's
# speed once an observer has corrected it.
INTEGRAL, FLOWING, CORRECTED, STATE_WIDTH = 4, 5, 6, 7

# What a start may hold beyond motion and integral part: how far the bristles are stretched, as a share; by how much the
# recorded effort acts before its stamp and the speed is older than its stamp [s], a part of a tick; and how far behind
# the joint an appendage is [rad], and how fast it falls behind [rad/s].
STRETCHED, SHIFT, SWING, SWING_RATE = range(5, 9)

# A row of what a sample shows: position, speed, effort, and in the predict modes the innovations.
SHOWN_EFFORT, INNOVATION, SHOWN_WIDTH = 2, 3, 5

# Rows of the scratch vectors. TORQUES carries factor, motor, output and spring torque from a substep to the next.
# JUMPED is the sum of what an observer has added to the motion; SHIFTED how early the effort and how old the speed is.
X, MIDDLE, FREE, TORQUES, SEEN, SENSED, LATE, MEMORY, JUMPED, FITTED, SHIFTED, KEPT = range(12)
VECTORS = KEPT + 2
