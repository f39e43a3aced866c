"""``python -m optuav`` is the command ``optuav``."""

from optuav.cli import main

if __name__ == "__main__":  # not where a process of a study imports this module
    main()
