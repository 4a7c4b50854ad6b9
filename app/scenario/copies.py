"""What was run, as files of a record: scenario, cell and tree as they were, with overrides applied.

`regrasp run DIR/scenario.yaml` runs the same again, whatever became of the files since.
"""

from typing import Any

import yaml

from regrasp.app.scenario.load import Scenario


def copies(scenario: Scenario, seed: int) -> dict[str, str]:
    """Name to text of scenario.yaml, which names the other two, cell.yaml and tree.xml."""
    values = scenario.file.model_dump(mode="json") | {"cell": "cell.yaml", "tree": "tree.xml", "seed": seed}
    return {
        "scenario.yaml": _yaml(values),
        "cell.yaml": _yaml(scenario.cell.model_dump(mode="json")),
        "tree.xml": scenario.tree.read_text(encoding="utf-8-sig"),
    }


def _yaml(values: Any) -> str:
    return yaml.safe_dump(values, sort_keys=False, allow_unicode=True, width=120)
