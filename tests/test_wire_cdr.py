import pytest
from recordings import JOINT_STATE, JOINT_STATE_IDL, NAMES, T0, joint_state, motion

from gsfdi.wire import cdr
from gsfdi.wire.leaves import UndecodableError

NAME = "sensor_msgs/msg/JointState"
TYPES = cdr.schema_types(NAME, "ros2msg", JOINT_STATE)
POSITION, VELOCITY, EFFORT = motion(1, 3)
MESSAGE = joint_state(T0, NAMES, POSITION[0], VELOCITY[0], EFFORT[0])


def test_both_schema_languages_say_the_same() -> None:
    idl = cdr.schema_types(NAME, "ros2idl", JOINT_STATE_IDL)
    assert idl[""] == TYPES[""]
    assert idl["std_msgs/Header"] == TYPES["std_msgs/Header"]


def test_leaves_stand_where_their_bytes_are() -> None:
    anatomy = cdr.decoder(TYPES)(MESSAGE)
    found = {leaf.path: leaf for leaf in anatomy.leaves}
    assert [found[f"name[{i}]"].text for i in range(3)] == list(NAMES)
    at = found["velocity[1]"]
    assert MESSAGE[at.offset : at.offset + 8] == VELOCITY[0, 1:2].tobytes()
    assert (found["header.stamp.sec"].offset, found["header.frame_id"].text) == (4, "base")


def test_lengths_are_structure_and_padding_is_not() -> None:
    mask = cdr.decoder(TYPES)(MESSAGE).mask
    rubbish = [i for i, byte in enumerate(MESSAGE) if byte == 0xA5]
    assert rubbish
    assert not any(mask[i] for i in rubbish)
    lengths = 5 + len(NAMES)  # frame, four arrays, each name
    assert sum(map(bool, mask)) == 2 + 4 * lengths + 1 + len(NAMES)  # and the zero that ends each string


@pytest.mark.parametrize("size", range(0, len(MESSAGE) - 8, 7))
def test_a_message_cut_anywhere_is_refused(size: int) -> None:
    with pytest.raises(UndecodableError):
        cdr.decoder(TYPES)(MESSAGE[:size])


def test_big_endian_and_reduced_alignment_are_read() -> None:
    big = joint_state(T0, NAMES, POSITION[0], big=True)
    assert cdr.decoder(TYPES)(big).big_endian
    reduced = b"\0\7\0\0" + MESSAGE[4:]
    with pytest.raises(UndecodableError):  # its doubles stand where XCDR2 does not look for them
        cdr.decoder(cdr.schema_types("a/B", "ros2msg", "uint32 n\nfloat64 x"))(reduced[:10])
    anatomy = cdr.decoder(cdr.schema_types("a/B", "ros2msg", "uint32 n\nfloat64 x"))(b"\0\7\0\0" + bytes(12))
    assert anatomy.leaves[1].offset == 8


def test_a_length_of_billions_costs_nothing() -> None:
    types = cdr.schema_types("a/B", "ros2msg", "float64[] x")
    with pytest.raises(UndecodableError):
        cdr.decoder(types)(b"\0\1\0\0\xff\xff\xff\xff" + bytes(64))


@pytest.mark.parametrize(
    ("text", "fields"),
    [
        ("int32 X=5\nfloat64 x  # why\n", [("x", "float64", None)]),
        (
            "string<=10 s 'a=b'\nfloat32[3] a\nint8[<=4] b\n",
            [("s", "string", None), ("a", "float32", 3), ("b", "int8", 0)],
        ),
        ("Point p\nother/Thing[] q\n", [("p", "a/Point", None), ("q", "other/Thing", 0)]),
    ],
)
def test_message_definitions_are_parsed(text: str, fields: list[tuple[str, str, int | None]]) -> None:
    assert [tuple(field) for field in cdr.schema_types("a/msg/B", "ros2msg", text)[""]] == fields


def test_idl_with_typedefs_constants_and_annotations() -> None:
    text = """
    module a { module msg {
      module B_Constants { const long N = 3; const string S = "x; }"; };
      typedef double double__3[3];
      enum Mode { ONE, TWO };
      @verbatim (language="comment", text=" a (b) ")
      struct B {
        @unit (value="m") double__3 p; sequence<a::msg::C, 5> c; unsigned long long n; Mode mode; string<8> s;
      };
      struct C { uint8 structure_needs_at_least_one_member; };
    }; };
    """
    types = cdr.schema_types("a/msg/B", "ros2idl", text)
    assert [tuple(field) for field in types[""]] == [
        ("p", "float64", 3),
        ("c", "a/C", 0),
        ("n", "uint64", None),
        ("mode", "uint32", None),
        ("s", "string", None),
    ]
    assert types["a/C"] == ()


@pytest.mark.parametrize("text", ["module {", "struct B { union x; } ", "nonsense here!", "float64"])
def test_schemas_that_make_no_sense_are_refused(text: str) -> None:
    with pytest.raises(UndecodableError):
        cdr.schema_types("a/msg/Missing", "ros2idl", text)


def test_a_line_that_is_no_field_is_refused() -> None:
    with pytest.raises(UndecodableError, match="nonsense here!"):
        cdr.schema_types("a/msg/B", "ros2msg", "nonsense here!")
