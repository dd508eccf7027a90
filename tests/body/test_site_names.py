"""The words that names of sites begin with are the same in all rooms."""

from mocap_jax.body.site_names import ANCHOR_PREFIX, PREFIXES, SOURCE_PREFIX
from mocap_jax.simulation import Anchor, Mounting, Suit


def test_suits_name_their_devices_alike() -> None:
    hat = Mounting("hat", "Head", (0.0, 0.0, 0.1))
    suit = Suit((), (hat,), anchors=(Anchor("door", (1.0, 0.0, 2.0)),))
    assert suit.worn_sites == (f"{SOURCE_PREFIX}hat",)
    assert suit.anchors[0].site == f"{ANCHOR_PREFIX}door"
    assert set(PREFIXES) == {"source/", "anchor/"}
