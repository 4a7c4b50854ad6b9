"""`python -m regrasp`: the same as the command `regrasp`."""

from regrasp.app.__main__ import main

if __name__ == "__main__":
    main()
