"""Every line names its file, what is wrong with it and what would mend it."""

from gsfdi.clock import LEFT_OUT
from gsfdi.pipeline.quality_lines import MENDS, quality_line

ROW = {"source": "a/night.mcap", "joint": "EL", "samples": 98, "span_s": 1.0, "rate_hz": 100.0, "gaps": 0, "new": True}


def test_a_clean_joint_is_told_in_few_words() -> None:
    line = quality_line({**ROW, "masked": {"position": {}}, "left_out": {}})
    assert line == "a/night.mcap: EL: 98 samples, 1.0 s at 100 Hz, 0 gaps; masked: nothing"


def test_advice_is_given_once_and_for_what_was_found() -> None:
    masked = {"position": {"stuck": 3.0}, "motor_current": {"dead": 98.0, "saturated": 5.0}}
    line = quality_line({**ROW, "masked": masked, "left_out": {}, "new": False})
    assert "position stuck 3, motor current dead 98, saturated 5; check the sensor; in the store already" in line


def test_whatever_is_left_out_can_be_mended() -> None:
    assert set(LEFT_OUT) <= set(MENDS)
