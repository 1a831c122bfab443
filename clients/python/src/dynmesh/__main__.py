"""``python -m dynmesh``: the command."""

import sys

from .cli import main

sys.exit(main())
