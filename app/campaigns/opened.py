"""A campaign by the name that a user types: a folder, or DIR@2 for its second version."""

from collections.abc import Iterator
from contextlib import contextmanager

from regrasp.app.campaigns.episodes import KIND
from regrasp.app.campaigns.store import Store, Version, folder_named
from regrasp.app.files.findings import Finding, Findings


@contextmanager
def opened(name: str) -> Iterator[tuple[Store, Version]]:
    """The store in a folder, and the version that the name means: DIR@2, or the last one that did any run.

    Raises `Findings` if there is no such campaign of scenarios.
    """
    folder, number = folder_named(name)
    with Store.read(folder) as store:
        if store.kind != KIND:
            raise Findings([Finding(str(folder), 0, f"holds {store.kind}; name the folder of a campaign of scenarios")])
        with_runs = [version for version in store.versions() if version.runs]
        if not with_runs:
            raise Findings([Finding(str(folder), 0, "holds no run yet; wait for the first")])
        chosen = [version for version in with_runs if str(version.id) == number] if number else with_runs[-1:]
        if not chosen:
            known = ", ".join(f"@{version.id}" for version in with_runs)
            raise Findings([Finding(name, 0, f"no version {number} with runs; there is {known}")])
        yield store, chosen[0]
