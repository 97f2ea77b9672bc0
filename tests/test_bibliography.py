"""Every citation resolves."""

import pytest

from realtime.techniques import MODULES, technique
from scenes.bibliography import BIBLIOGRAPHY
from scenes.media import MEDIA


@pytest.mark.parametrize("name", MODULES)
def test_the_source_of_a_technique_is_in_the_bibliography(name: str) -> None:
    assert technique(name).source in BIBLIOGRAPHY


def test_every_entry_is_cited_and_says_who_when_and_what() -> None:
    cited = {technique(name).source for name in MODULES} | {medium.source for medium in MEDIA.values()}
    assert cited == set(BIBLIOGRAPHY)
    assert all(len(entry) > 40 and "(" in entry for entry in BIBLIOGRAPHY.values())
