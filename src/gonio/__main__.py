"""`python -m gonio` is the command `gonio`."""

from gonio.app.cli import main

if __name__ == "__main__":
    main()
