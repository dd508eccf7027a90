"""What a free root rests on is said as it is: no rates or accelerations that were not used."""

from mocap_jax.estimate.inputs import gauge_remarks


def test_a_given_root_needs_no_words():
    assert gauge_remarks(True) == ()


def test_inertial_data_alone_drift():
    (text,) = gauge_remarks(False, kinds="AGDO")
    assert text == (
        "Root free: its position and heading come from accelerations and rates alone and drift; "
        "they are tied to the declared pose at the start."
    )


def test_orientations_alone_know_nothing_of_accelerations_and_rates():
    (text,) = gauge_remarks(False, kinds="O", oriented=True)
    assert "heading is that of the measured orientations" in text and "position" in text
    assert not any(word in text for word in ("accelerations", "rates", "drift"))


def test_orientations_beside_inertial_data_hold_the_heading():
    (text,) = gauge_remarks(False, kinds="AGO", oriented=True)
    assert text.startswith("Root free: its position comes from accelerations alone and drifts;")
    assert text.endswith("; its heading is that of the measured orientations.")


def test_contacts():
    (text,) = gauge_remarks(False, contacts=True)
    assert text == (
        "Root free: its position and heading come from standing feet, accelerations and rates, "
        "and drift slowly; they are tied to the declared pose at the start."
    )
    (text,) = gauge_remarks(False, oriented=True, contacts=True)
    assert "position comes from standing feet and accelerations, and drifts slowly" in text


def test_magnetometers_tell_the_heading() -> None:
    (text,) = gauge_remarks(False, kinds="AGM")
    assert "its heading is that of the magnetometers" in text
    assert "its position comes from accelerations alone and drifts" in text
