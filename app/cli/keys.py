"""Reads single keys from a terminal, without Enter."""

import os
import re
import select
import sys
import termios
import tty
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

# Names of the sequences that terminals send; those that mean the same have one name.
KEY_NAMES = {
    **dict.fromkeys(("\x1b[C", "\x1bOC", "\x1b[B", "\x1bOB"), "forward"),
    **dict.fromkeys(("\x1b[D", "\x1bOD", "\x1b[A", "\x1bOA"), "back"),
    **dict.fromkeys(("\x1b[H", "\x1bOH", "\x1b[1~", "\x1b[7~"), "home"),
    **dict.fromkeys(("\x1b[F", "\x1bOF", "\x1b[4~", "\x1b[8~"), "end"),
    "\x1b[6~": "page forward",
    "\x1b[5~": "page back",
    "\x1b": "escape",
    "\r": "enter",
    "\n": "enter",
    "\x7f": "delete",
    "\b": "delete",
}
_KEY = re.compile(r"\x1b\[[0-9;]*[~A-Za-z]|\x1bO[A-Z]|.", re.DOTALL)
_SPLIT = re.compile(r"\x1b(\[[0-9;]*|O)?$")  # an incomplete key sequence


@contextmanager
def keyboard() -> Iterator[Callable[[], str | None]]:
    """Yields a function that waits up to 0.5 s for a key: its name or character, '' for none, None at the end of stdin.

    stdin must be a terminal; its settings are restored when the context ends. Ctrl-C still raises KeyboardInterrupt;
    Ctrl-Z does nothing, for it would leave the terminal without its settings restored.
    """
    stdin = sys.stdin.fileno()
    before = termios.tcgetattr(stdin)
    waiting: deque[str] = deque()

    def read() -> str | None:
        if not waiting:
            if not select.select([stdin], [], [], 0.5)[0]:
                return ""
            if not (data := os.read(stdin, 1024)):
                return None
            text = data.decode(errors="replace")
            if _SPLIT.search(text) and select.select([stdin], [], [], 0.05)[0]:
                text += os.read(stdin, 1024).decode(errors="replace")
            waiting.extend(_KEY.findall(text))
        key = waiting.popleft()
        return KEY_NAMES.get(key, key)

    try:
        tty.setcbreak(stdin)
        now = termios.tcgetattr(stdin)
        now[6][termios.VSUSP] = os.fpathconf(stdin, "PC_VDISABLE").to_bytes()
        termios.tcsetattr(stdin, termios.TCSANOW, now)
        yield read
    finally:
        termios.tcsetattr(stdin, termios.TCSADRAIN, before)
