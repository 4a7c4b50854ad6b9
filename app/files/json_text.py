"""JSON for people to read."""

import json
import re
from typing import Any


def json_text(answer: dict[str, Any]) -> str:
    """JSON, indented, each list of numbers on one line."""
    text = json.dumps(answer, indent=2, allow_nan=False)
    return re.sub(r"\[\n[-+.,e\d\s]+\]", lambda numbers: f"[{' '.join(numbers[0][1:-1].split())}]", text)
