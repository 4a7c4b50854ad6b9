"""Entry point of `regrasp` and of `python -m app`."""

import signal
import sys
from types import FrameType


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def main() -> None:
    """Run the command line; SIGTERM ends it as Ctrl-C does, with the record kept."""
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        from app.cli import app  # takes a moment, in which Ctrl-C may come

        app()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)


if __name__ == "__main__":
    main()
