"""`gauge_remarks`: what a solution says about roots that were not measured."""

from __future__ import annotations

from mocap_jax.estimate.free_roots import FreeRoot


def gauge_remarks(
    roots: tuple[FreeRoot, ...], *, kinds: str = "AG", oriented: bool = False,
    contacts: bool = False,
) -> tuple[str, ...]:  # fmt: skip
    """One remark for every root that was not measured.

    Args:
        roots: of the people in the body.
        kinds: letters of the kinds of measurements used.
        oriented: measured orientations were among them.
        contacts: standing feet were held.
    """
    measured = [root.name for root in roots if root.tie == "measured"]
    out = []
    for root in roots:
        if root.tie == "measured":
            continue
        who = "Root" if len(roots) == 1 else f"Root of {root.name}"
        told = _place(root) or _adrift(kinds, oriented, contacts)
        first = f"The measured root is that of {measured[0]}. " if measured else ""
        out.append(f"{first}{who} free: {told}")
    return tuple(out)


def _place(root: FreeRoot) -> str:
    """What ranges tell of a root; nothing where there are none."""
    return {
        "anchors": "ranges that lead to anchors tell where in the room it is.",
        "person": f"ranges tell where it is as seen from {root.person}.",
    }.get(root.tie, "")


def _adrift(kinds: str, oriented: bool, contacts: bool) -> str:
    """What a root rests on that neither a measurement nor ranges hold."""
    heading = "its heading is that of the measured orientations"
    if "M" in kinds and not oriented:
        oriented, heading = True, "its heading is that of the magnetometers"
    if oriented and not set(kinds) & {"A", "G"} and not contacts:
        return f"{heading}; nothing measures its position, which stays near the start."
    sources = ["standing feet"] * contacts + ["accelerations"] + ["rates"] * (not oriented)
    where = ", ".join(sources[:-1]) + " and " * (len(sources) > 1) + sources[-1]
    what, one = ("position", "s") if oriented else ("position and heading", "")
    alone = "" if contacts else " alone"
    slowly = f", and drift{one} slowly" if contacts else f" and drift{one}"
    tied = "it is" if oriented else "they are"
    known = f"; {heading}" if oriented else ""
    return (
        f"its {what} come{one} from {where}{alone}{slowly}; {tied} tied to the declared pose at "
        f"the start{known}."
    )
