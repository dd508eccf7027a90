"""Writers of foreign files, shared with the tests of their readers."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "io" / "convert"))
