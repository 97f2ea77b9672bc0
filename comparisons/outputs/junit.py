"""JUnit XML of a run, by the schema of Jenkins' xUnit plugin (junit-10.xsd), which others read too.

The schema has no properties of a single test. They stand in its output, one `[[PROPERTY|name=value]]` a line, as test
managers read them; pictures as `[[ATTACHMENT|path]]`, which GitLab and Jenkins show.
"""

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

from comparisons.outputs.words import failure_lines, headline_text, one_line, pictures_of
from comparisons.report.check import CheckView
from comparisons.report.view import Overview

NOT_XML = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""What XML 1.0, section 2.2 "Characters", forbids even as an escape."""


def junit_xml(overview: Overview, folder: Path, started: str, complaint: str = "") -> str:
    """A test suite for each scene and for each that could not be read, a test for each check.

    FAIL, REGRESSED and INCONCLUSIVE are failures of that type, ERROR is an error. The time of a test is that of its
    image and its truth, whenever they were rendered; what checks share counts for each.

    Parameters
    ----------
    folder : that of the report, which pictures are relative to.
    started : when the run did, in UTC as ISO 8601.
    complaint : why the gate as a whole is not held; a failure of its own if not empty.
    """
    root = ET.Element("testsuites", name="lightgauge")
    views = sorted(overview.all, key=lambda view: (view.raw["scene"], view.raw["id"]))
    for scene, members in groupby(views, key=lambda view: str(view.raw["scene"])):
        root.append(_suite(scene, [_case(view, folder) for view in members], overview, started))
    for argument, message in overview.broken:
        root.append(_suite(argument, [_broken(argument, message)], overview, started))
    if complaint:
        case = ET.Element("testcase", classname="lightgauge", name="enough checks were judged", time="0.000")
        _told(ET.SubElement(case, "failure", type="min-checks", message=_clean(complaint)), complaint)
        root.append(_suite("lightgauge", [case], overview, started))
    for key in ("tests", "failures", "errors"):
        root.set(key, str(sum(int(suite.attrib[key]) for suite in root)))
    root.set("time", _seconds(sum(float(suite.attrib["time"]) for suite in root)))
    ET.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _suite(name: str, cases: list[ET.Element], overview: Overview, started: str) -> ET.Element:
    suite = ET.Element("testsuite", name=_clean(name), tests=str(len(cases)))
    suite.set("failures", str(sum(case.find("failure") is not None for case in cases)))
    suite.set("errors", str(sum(case.find("error") is not None for case in cases)))
    suite.set("skipped", "0")
    suite.set("time", _seconds(sum(float(case.attrib["time"]) for case in cases)))
    suite.set("timestamp", started[:19])
    properties = ET.SubElement(suite, "properties")
    for key, value in overview.environment.items():
        ET.SubElement(properties, "property", name=_clean(key), value=_clean(value))
    suite.extend(cases)
    return suite


def _case(view: CheckView, folder: Path) -> ET.Element:
    seconds = view.raw.get("seconds") or {}
    case = ET.Element(
        "testcase",
        classname=_clean(f"{view.effect.replace(' ', '-')}.{view.raw['scene']}"),
        name=_clean(view.raw["id"].removeprefix(f"{view.raw['scene']}/")),
        time=_seconds(sum(seconds.get(side) or 0.0 for side in ("realtime", "reference"))),
    )
    if view.verdict != "PASS":
        tag = "error" if view.verdict == "ERROR" else "failure"
        found = ET.SubElement(case, tag, type=view.verdict.lower(), message=_clean(headline_text(view)))
        _told(found, "\n".join(failure_lines(view, folder)))
    _told(ET.SubElement(case, "system-out"), "\n".join(_output(view, folder)))
    return case


def _output(view: CheckView, folder: Path) -> Iterator[str]:
    yield f"[[PROPERTY|verdict={view.verdict}]]"
    for criterion in view.raw.get("criteria") or []:
        for key in ("value", "low", "high", "min", "max"):
            if criterion.get(key) is not None:
                yield f"[[PROPERTY|{criterion['metric']}.{key}={criterion[key]:.6g}]]"
    for key in ("spp", "gl_renderer"):
        if view.raw.get(key):
            yield f"[[PROPERTY|{key}={view.raw[key]}]]"
    yield from (f"[[ATTACHMENT|{path}]]" for _, path in pictures_of(view, folder))


def _broken(argument: str, message: str) -> ET.Element:
    case = ET.Element("testcase", classname=_clean(argument), name="the scene can be read", time="0.000")
    _told(ET.SubElement(case, "error", type="error", message=_clean(one_line(message))), message)
    return case


def _told(element: ET.Element, text: str) -> None:
    element.text = _clean(text)


def _clean(text: str) -> str:
    return NOT_XML.sub("", text)


def _seconds(seconds: float) -> str:
    return f"{seconds:.3f}"
