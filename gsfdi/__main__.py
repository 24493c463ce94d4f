"""``python -m gsfdi``: the same as the ``gsfdi`` command."""

from gsfdi.cli import main

if __name__ == "__main__":
    main()
