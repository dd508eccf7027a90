"""`unlisted_boards`: a set-up that names other boards than those that measured."""

from __future__ import annotations

from mocap_jax.recording.recording import Recording


def unlisted_boards(recording: Recording) -> tuple[str, ...]:
    """Boards that measured though the set-up does not name them, in a sentence; empty if none.

    A set-up may name boards that measured nothing: they dropped out, or were cut away. One without
    any names leaves them to the sites.
    """
    listed = [s.name for s in recording.setup.sensors]
    strange = [name for name in recording.inertial if name not in listed]
    if not listed or not strange:
        return ()
    return (
        f"The set-up does not name board{'s' * (len(strange) > 1)} {', '.join(strange)}, taken to "
        f"sit on the site of the same name; it names {', '.join(listed)}.",
    )
