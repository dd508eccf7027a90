"""Recordings as MCAP files: the topics and attachments."""

INERTIAL, MAGNETIC, TRUTH = "/inertial/", "/magnetic/", "/truth"
RANGE, ROOT, TEMPERATURE = "/range", "/root", "/temperature"
TRUE_BODY, TRUE_PARAMETERS = "truth/body.xml", "truth/parameters.npz"
ACOUSTIC, PULSE, DRIVER_BOX = "/acoustic/", "/pulse", "driver_box.toml"
SETUP = "setup.toml"
