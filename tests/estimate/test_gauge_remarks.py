"""What a free root rests on is said as it is: no rates or accelerations that were not used."""

from mocap_jax.estimate.free_roots import FreeRoot
from mocap_jax.estimate.gauge_remarks import gauge_remarks

ADRIFT = (FreeRoot("Pelvis", 0, 0, "none"),)
FIRST, SECOND = FreeRoot("a/Pelvis", 0, 0, "measured"), FreeRoot("b/Pelvis", 7, 6, "none")


def test_a_given_root_needs_no_words():
    assert gauge_remarks((FreeRoot("Pelvis", 0, 0, "measured"),)) == ()


def test_a_second_person_is_free_where_the_root_of_the_first_is_given():
    (text,) = gauge_remarks((FIRST, SECOND))
    assert text.startswith("The measured root is that of a/Pelvis. Root of b/Pelvis free: its")
    assert text.endswith("they are tied to the declared pose at the start.")
    heard = FreeRoot("b/Pelvis", 7, 6, "person", "a/Pelvis")
    (text,) = gauge_remarks((FIRST, heard))
    assert text.endswith("Root of b/Pelvis free: ranges tell where it is as seen from a/Pelvis.")


def test_every_person_is_named():
    first, second = gauge_remarks((FreeRoot("a/Pelvis", 0, 0, "anchors"), SECOND))
    assert first == (
        "Root of a/Pelvis free: ranges that lead to anchors tell where in the room it is."
    )
    assert second.startswith("Root of b/Pelvis free: its position and heading come from")


def test_with_anchors_nothing_is_said_to_drift():
    (text,) = gauge_remarks((FreeRoot("Pelvis", 0, 0, "anchors"),), kinds="AGD")
    assert text == "Root free: ranges that lead to anchors tell where in the room it is."


def test_inertial_data_alone_drift():
    (text,) = gauge_remarks(ADRIFT, kinds="AGDO")
    assert text == (
        "Root free: its position and heading come from accelerations and rates alone and drift; "
        "they are tied to the declared pose at the start."
    )


def test_orientations_alone_know_nothing_of_accelerations_and_rates():
    (text,) = gauge_remarks(ADRIFT, kinds="O", oriented=True)
    assert "heading is that of the measured orientations" in text and "position" in text
    assert not any(word in text for word in ("accelerations", "rates", "drift"))


def test_orientations_beside_inertial_data_hold_the_heading():
    (text,) = gauge_remarks(ADRIFT, kinds="AGO", oriented=True)
    assert text.startswith("Root free: its position comes from accelerations alone and drifts;")
    assert text.endswith("; its heading is that of the measured orientations.")


def test_contacts():
    (text,) = gauge_remarks(ADRIFT, contacts=True)
    assert text == (
        "Root free: its position and heading come from standing feet, accelerations and rates, "
        "and drift slowly; they are tied to the declared pose at the start."
    )
    (text,) = gauge_remarks(ADRIFT, oriented=True, contacts=True)
    assert "position comes from standing feet and accelerations, and drifts slowly" in text


def test_magnetometers_tell_the_heading() -> None:
    (text,) = gauge_remarks(ADRIFT, kinds="AGM")
    assert "its heading is that of the magnetometers" in text
    assert "its position comes from accelerations alone and drifts" in text
