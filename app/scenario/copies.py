"""Copies of what was run, for the record: scenario and cell with overrides applied, and the tree.

`regrasp run DIR/scenario.yaml` runs the same again, even if the original files have changed.
"""

from typing import Any

import yaml

from regrasp.app.scenario.load import Scenario


def copies(scenario: Scenario, seed: int) -> dict[str, str]:
    """The text by file name of scenario.yaml, cell.yaml and tree.xml; the first names the others."""
    values = scenario.file.model_dump(mode="json") | {"cell": "cell.yaml", "tree": "tree.xml", "seed": seed}
    values["task"] = scenario.file.TASK
    if scenario.file.draw is None:
        del values["draw"]
    return {
        "scenario.yaml": _yaml(values),
        "cell.yaml": _yaml(scenario.cell.model_dump(mode="json")),
        "tree.xml": scenario.tree.read_text(encoding="utf-8-sig"),
    }


def _yaml(values: Any) -> str:
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)  # without libyaml it takes ten times as long
    return str(yaml.dump(values, Dumper=dumper, sort_keys=False, allow_unicode=True, width=120))
