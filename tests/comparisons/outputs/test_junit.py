"""JUnit XML, read by a parser, and held against what the schema of Jenkins' xUnit plugin (junit-10.xsd) allows."""

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparisons.outputs.junit import junit_xml
from comparisons.report.view import overview_of

Make = Callable[..., dict[str, Any]]

ALLOWED = {
    "testsuites": {"name", "time", "tests", "failures", "errors"},
    "testsuite": {"name", "tests", "failures", "errors", "time", "skipped", "timestamp"},
    "properties": set(),
    "property": {"name", "value"},
    "testcase": {"name", "time", "classname"},
    "failure": {"type", "message"},
    "error": {"type", "message"},
    "system-out": set(),
}
REQUIRED = {
    "testsuite": {"name", "tests", "failures", "errors"},
    "property": {"name", "value"},
    "testcase": {"name", "classname"},
}
INSIDE = {
    "testsuites": {"testsuite"},
    "testsuite": {"properties", "testcase"},
    "properties": {"property"},
    "testcase": {"failure", "error", "system-out"},
}
TIME = re.compile(r"(([0-9]{0,3},)*[0-9]{3}|[0-9]{0,3})*(\.[0-9]{0,3})?")


def parsed(results: dict[str, Any], complaint: str = "") -> ET.Element:
    return ET.fromstring(junit_xml(overview_of(results), Path("report"), results["started"], complaint).encode())


def case_of(root: ET.Element, scene: str, name: str = "indirect.probe") -> ET.Element:
    (case,) = root.findall(f"testsuite[@name='{scene}']/testcase[@name='{name}']")
    return case


def test_it_is_as_the_schema_wants_it(bad_run: dict[str, Any]) -> None:
    root = parsed(bad_run, complaint="Too few checks.")
    assert root.tag == "testsuites"
    for element in root.iter():
        assert set(element.attrib) <= ALLOWED[element.tag]
        assert set(element.attrib) >= REQUIRED.get(element.tag, set())
        assert {child.tag for child in element} <= INSIDE.get(element.tag, set())
        assert TIME.fullmatch(element.get("time", "0.000"))


def test_counts_are_those_of_the_tests_inside(bad_run: dict[str, Any]) -> None:
    root = parsed(bad_run)
    for holder in (root, *root.findall("testsuite")):
        for key, path in (("tests", "testcase"), ("failures", "testcase/failure"), ("errors", "testcase/error")):
            assert int(holder.attrib[key]) == len(holder.findall(f".//{path}"))
    assert (root.attrib["tests"], root.attrib["failures"], root.attrib["errors"]) == ("7", "3", "2")
    assert root.findall("testsuite")[0].attrib["timestamp"] == "2026-01-31T12:00:00"


def test_each_verdict_has_its_kind(bad_run: dict[str, Any]) -> None:
    root = parsed(bad_run)
    kinds = {
        scene: [(child.tag, child.get("type")) for child in case_of(root, scene) if child.tag != "system-out"]
        for scene in ("room", "hall", "attic", "cellar", "shed")
    }
    assert kinds == {
        "room": [],
        "hall": [("failure", "fail")],
        "attic": [("failure", "regressed")],
        "cellar": [("failure", "inconclusive")],
        "shed": [("error", "error")],
    }


def test_a_failure_says_all_that_helps(bad_run: dict[str, Any]) -> None:
    failure = case_of(parsed(bad_run), "hall").find("failure")
    assert failure is not None
    assert failure.attrib["message"] == "nrmse 30.0\u202f% [28.0, 32.0], budget ≤ 20\u202f%"
    assert (failure.text or "").splitlines() == [
        "FAIL nrmse 30.0\u202f% [28.0, 32.0], budget ≤ 20\u202f%",
        "  reason for the budget: 100 % <b> | no",
        "  accepted 10.0\u202f% on 2026-01-01",
        "  written at scenes/hall.toml:40",
        "worst pixel (3, 5) from the top left: real-time 0.500, 0.400, 0.300; truth 0.250 ± 0.0100, 0.200 ± 0.0100, "
        "0.100 ± 0.0200 W/(m² sr)",
        "picture of the error: report/images/a-error.png",
        "picture of the real-time side: report/images/a-realtime.png",
        "picture of the truth: report/images/a-truth.png",
        "again: lightgauge run room.toml -k indirect.probe",
    ]


def test_numbers_and_pictures_stand_where_tools_look_for_them(bad_run: dict[str, Any]) -> None:
    case = case_of(parsed(bad_run), "hall")
    assert case.attrib["classname"] == "indirect-light.hall"
    assert case.attrib["time"] == "3.020"
    lines = (case.findtext("system-out") or "").splitlines()
    assert "[[PROPERTY|nrmse.value=0.3]]" in lines
    assert "[[PROPERTY|nrmse.max=0.2]]" in lines
    assert "[[PROPERTY|spp=64]]" in lines
    assert next(line for line in lines if "ATTACHMENT" in line) == "[[ATTACHMENT|report/images/a-error.png]]"


def test_a_scene_that_cannot_be_read_is_an_error_and_a_gate_that_is_not_held_a_failure(bad_run: dict[str, Any]) -> None:
    root = parsed(bad_run, complaint="Too few checks: 3.")
    assert case_of(root, "scenes/ruin.toml", "the scene can be read").findtext("error") == "line 3: no such key"
    assert case_of(root, "lightgauge", "enough checks were judged").findtext("failure") == "Too few checks: 3."


@given(st.text())
def test_whatever_a_message_holds_the_file_can_be_parsed(make_judged: Make, make_run: Make, text: str) -> None:
    results = make_run(make_judged(verdict="ERROR", message=text, rerun=""), commit=text)
    error = case_of(parsed(results), "room").find("error")
    kept = "".join(
        c for c in text if c in "\t\n\r" or ("\x20" <= c <= "\ud7ff" or "\ue000" <= c <= "\ufffd" or c > "\uffff")
    )
    assert error is not None
    assert "".join((error.text or "").split()) == "".join(kept.split())


@pytest.mark.parametrize("character", ["\x00", "\x1b", "\ud800", "\ufffe"])
def test_what_xml_forbids_is_left_out(make_judged: Make, make_run: Make, character: str) -> None:
    results = make_run(make_judged(verdict="ERROR", message=f"[{character}31m red", rerun=""))
    assert case_of(parsed(results), "room").findtext("error") == "[31m red"
