"""`make readme`: every command of README.md, in its order, with how long each took. Run it in a fresh clone.

Each is run by bash in the current folder; the first that ends with another exit code than its own stops all.
"""

import argparse
import os
import re
import subprocess
import sys
import time
from pathlib import Path

README = Path(__file__).parents[2] / "README.md"
COMMAND = re.compile(r"(?: {4})?((?:regrasp|make|pytest|source) [^#\n]*?) *(?:#.*)?")
EXIT_CODES = {"diff": 1}  # of subcommands that end otherwise than with 0: the two runs part


def commands(text: str) -> list[str]:
    """The commands in the text's code blocks, in their order, without their comments."""
    return [match[1] for line in text.splitlines() if (match := COMMAND.fullmatch(line))]


def main() -> int:
    """Run them; 0 when each ended as it should."""
    parser = argparse.ArgumentParser(description="Run every command of README.md in its order.")
    parser.add_argument(
        "--without", action="append", default=[], metavar="TEXT", help="Leave out what holds this text."
    )
    parser.add_argument("--list", action="store_true", help="Only print them.")
    options = parser.parse_args()
    environment = {**os.environ, "PATH": f"{Path('.venv/bin').resolve()}{os.pathsep}{os.environ['PATH']}"}
    for command in commands(README.read_text(encoding="utf-8")):
        if options.list or any(text in command for text in options.without):
            print(f"{'':>9} {command}")
            continue
        began = time.monotonic()
        ran = subprocess.run(["bash", "-c", command], env=environment, capture_output=True, text=True)
        print(f"{time.monotonic() - began:7.1f} s {command}", flush=True)
        if ran.returncode != next((code for word, code in EXIT_CODES.items() if word in command.split()), 0):
            print(f"exit code {ran.returncode}\n{ran.stdout[-2000:]}\n{ran.stderr[-2000:]}", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
