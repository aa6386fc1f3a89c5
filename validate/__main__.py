"""`python -m validate`: the command."""

import sys

from validate.cli import main

sys.exit(main())
