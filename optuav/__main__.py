"""``python -m optuav`` is the command ``optuav``."""

from optuav.cli import main

main()
