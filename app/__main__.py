"""Entry point of `regrasp` and of `python -m regrasp`."""

import gc
import io
import os
import sys
import warnings

from regrasp.app.interrupts import EXIT_INTERRUPTED, stoppable

# What a shell reports of cat or git when the reader of their pipe has gone. Not 0: output is missing. Not 1, which
# means an unmet expectation. SIGPIPE itself stays ignored: it would also end this program when a child dies.
EXIT_NO_READER = 141


def main() -> None:
    """Run the command line; SIGTERM and SIGHUP end it as Ctrl-C does, with the record kept."""
    _open_streams()
    warnings.formatwarning = _in_one_line
    gc.set_threshold(20_000)  # imports make objects that stay; to search them every 700 takes 0.2 s
    with stoppable():
        _run()


def _run() -> None:
    try:
        try:
            from regrasp.app.cli.commands import app  # takes a moment, in which Ctrl-C may come

            app()
        finally:
            sys.stdout.flush()  # what `print` left; the interpreter's own flush could not be caught
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(EXIT_INTERRUPTED)
    except (BrokenPipeError, SystemExit) as end:
        # Typer makes exit code 1 of a broken pipe.
        if isinstance(end, SystemExit) and not isinstance(end.__context__, BrokenPipeError):
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # for what is flushed at exit
        sys.exit(EXIT_NO_READER)


def _in_one_line(message: Warning | str, *_: object, **__: object) -> str:
    """A warning without the place in our code and its source line, which say nothing to a user."""
    return f"warning: {message}\n"


def _open_streams() -> None:
    """Replace standard streams that were closed from the start, as by `<&-`; without stdout the program ends.

    Python sets such a stream to None. The next file that is opened would get its descriptor, and what libraries print.
    """
    closed = sys.stdout is None
    for name, mode in {"stdin": "r", "stdout": "w", "stderr": "w"}.items():
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, errors="ignore"))  # noqa: SIM115 - to the end
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a question mark for characters that the encoding does not have
    if closed:
        print("standard output is closed; open it, or write > /dev/null", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
