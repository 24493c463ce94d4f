"""The laws of a model's terms, called by their addresses on what physics sees of the motion."""

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gsfdi import motion
from gsfdi.replay import layout as at
from gsfdi.replay.compiling import compiled, inlined


@intrinsic
def call_law(_typing, address, m, model, row, states, state):  # type: ignore[no-untyped-def]
    """Call the compiled law at `address` on the motion `m`, parameters from `row` of `model`, states from `state`."""

    def codegen(context, builder, signature, args):  # type: ignore[no-untyped-def]
        pointer = ir.DoubleType().as_pointer()
        law = ir.FunctionType(ir.DoubleType(), [pointer] * 3)
        data = [context.make_array(signature.args[i])(context, builder, args[i]).data for i in (1, 2, 4)]
        parts = [data[0], builder.gep(data[1], [args[3]]), builder.gep(data[2], [args[5]])]
        return builder.call(builder.inttoptr(args[0], law.as_pointer()), parts)

    return types.float64(types.int64, m, model, types.intp, states, types.intp), codegen


@compiled
def any_in(slot, model):  # type: ignore[no-untyped-def]
    """Whether any term acts in `slot`."""
    return model[at.FIRST + slot] < model[at.FIRST + slot + 1]


@compiled
def law_of(term, model, m, states):  # type: ignore[no-untyped-def]
    """Evaluate one term's law; the caller has seen to it that it has set in."""
    row = int(model[at.ERAS]) * at.ERA_WIDTH + at.ERA_ROWS + term * at.TERM_WIDTH
    m[motion.ONSET] = model[row + at.ONSET]
    return call_law(int(model[row + at.ADDRESS]), m, model, row + at.PARAMS, states, motion.STATES * term)


@compiled
def has_set_in(term, model, m):  # type: ignore[no-untyped-def]
    """Whether the onset of a term lies behind."""
    row = int(model[at.ERAS]) * at.ERA_WIDTH + at.ERA_ROWS + term * at.TERM_WIDTH
    return m[motion.TIME] >= model[row + at.ONSET]


@compiled
def total(slot, model, m, states):  # type: ignore[no-untyped-def]
    """Sum of the laws in `slot` that have set in."""
    result = 0.0
    if any_in(slot, model):
        for term in range(int(model[at.FIRST + slot]), int(model[at.FIRST + slot + 1])):
            if has_set_in(term, model, m):
                result += law_of(term, model, m, states)
    return result


@compiled
def product(slot, model, m, states):  # type: ignore[no-untyped-def]
    """Product of the factors in `slot`."""
    result = 1.0
    if any_in(slot, model):
        for term in range(int(model[at.FIRST + slot]), int(model[at.FIRST + slot + 1])):
            if has_set_in(term, model, m):
                result *= law_of(term, model, m, states)
    return result


@compiled
def mapped(slot, model, m, states, value):  # type: ignore[no-untyped-def]
    """`value` after the maps in `slot`, one upon the other."""
    if any_in(slot, model):
        m[motion.VALUE] = value
        for term in range(int(model[at.FIRST + slot]), int(model[at.FIRST + slot + 1])):
            if has_set_in(term, model, m):
                m[motion.VALUE] = law_of(term, model, m, states)
        value = m[motion.VALUE]
    return value


@compiled
def unmapped(slot, model, m, states, value):  # type: ignore[no-untyped-def]
    """What an affine chain of maps turned into `value`."""
    if not any_in(slot, model):
        return value
    low = mapped(slot, model, m, states, 0.0)
    return (value - low) / (mapped(slot, model, m, states, 1.0) - low)


@inlined
def see(model, m, v, row, time):  # type: ignore[no-untyped-def]
    """Write the motion of a row of the vectors into `m`, seen from the output side."""
    m[motion.TIME] = time
    m[motion.ANGLE] = m[motion.JOINT_ANGLE] = v[row, 0] + v[row, 2]
    m[motion.SPEED] = v[row, 1] + v[row, 3]
    m[motion.GEAR], m[motion.MOTOR_TURN] = model[at.GEAR], model[at.GEAR] * v[row, 0]
    m[motion.WINDUP], m[motion.WINDUP_RATE] = v[row, 2], v[row, 3]
    m[motion.ANGLE_JUMPED] = v[at.JUMPED, 0] + v[at.JUMPED, 2]
    m[motion.WINDUP_JUMPED] = v[at.JUMPED, 2]
    m[motion.DIRECTION] = 1.0 if m[motion.SPEED] >= 0 else -1.0
