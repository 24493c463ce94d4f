import numpy as np
import pytest
from recordings import protobuf_joints

from gsfdi.wire import proto
from gsfdi.wire.leaves import UndecodableError

NAME, SCHEMA, MESSAGE = protobuf_joints()
TAKE_APART = proto.decoder(proto.schema_types(NAME, SCHEMA))


def message(seconds: int = 5, position: float = 1.5) -> bytes:
    whole = MESSAGE()
    whole.timestamp.seconds = seconds
    whole.joints.add(name="J1", position=position, effort=-2.0)
    whole.joints.add(name="J2")
    return bytes(whole.SerializeToString())


def test_leaves_stand_where_their_bytes_are() -> None:
    data = message()
    found = {leaf.path: leaf for leaf in TAKE_APART(data).leaves}
    at = found["joints[0].position"]
    assert data[at.offset : at.offset + at.size] == np.float64(1.5).tobytes()
    assert found["joints[0].name"].text == "J1"
    assert found["timestamp.seconds"].kind == "varint"


def test_what_is_left_out_because_it_is_zero_is_a_leaf_all_the_same() -> None:
    found = {leaf.path: leaf for leaf in TAKE_APART(message(position=0.0)).leaves}
    assert found["joints[0].position"].kind == "zero"
    assert found["joints[1].effort"].kind == "zero"
    assert found["timestamp.nanos"].kind == "zero"


def test_numbers_may_change_and_structure_may_not() -> None:
    first, second = message(5, 1.5), message(9, -7.25)
    mask = TAKE_APART(first).mask
    assert len(first) == len(second)
    assert all(not (a ^ b) & m for a, b, m in zip(first, second, mask, strict=True))
    longer = message(300, 1.5)
    assert len(longer) > len(first)


def test_fields_that_the_schema_lacks_are_passed_over() -> None:
    unknown = b"\x78\x05" + b"\x7a\x03abc" + b"\x7d" + bytes(4) + b"\x79" + bytes(8)
    assert len(TAKE_APART(message() + unknown).leaves) == len(TAKE_APART(message()).leaves)


@pytest.mark.parametrize("size", range(1, 40, 3))
def test_a_message_cut_inside_a_field_is_refused_or_shorter(size: int) -> None:
    data = message()
    try:
        anatomy = TAKE_APART(data[:size])
    except UndecodableError:
        return
    MESSAGE.FromString(data[:size])  # what is accepted is a message to the reference decoder too
    assert len(anatomy.mask) == len(data[:size])


def test_schemas_that_make_no_sense_are_refused() -> None:
    for name, data in ((NAME, b"\xff\xff\xff"), ("arm.Nothing", SCHEMA)):
        with pytest.raises(UndecodableError):
            proto.schema_types(name, data)


def test_damaged_names_in_a_schema_are_text_all_the_same() -> None:
    damaged = SCHEMA.replace(b"position", b"posit\xffon")
    assert any(field.name.startswith("posit") for field in proto.schema_types(NAME, damaged)[".arm.Joint"].values())
