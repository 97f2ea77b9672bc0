import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from comparisons.answers.bench import PARTIAL
from comparisons.bench.ask import Asked, parts_of
from comparisons.bench.machine import BUSY, doubts, machine
from comparisons.bench.measure import Pace

QUICK = ("--seconds-per-point", "0.02", "--frames", "3")


@pytest.fixture
def bench(
    write_scene: Callable[..., Path], lightgauge: Callable[..., Any], gl: object, mi: object
) -> Callable[..., Any]:
    """Runs `lightgauge bench --scene tiny.toml -k indirect.talk`, quickly."""
    write_scene(("max_spp = 4096", "max_spp = 256"))
    return lambda *options: lightgauge("bench", "--scene", "tiny.toml", "-k", "indirect.talk", *QUICK, *options)


def test_a_benchmark_has_points_a_traced_side_and_a_sentence(
    bench: Callable[..., Any], lightgauge: Callable[..., Any]
) -> None:
    done = bench("--only", "points")
    assert done.status == 0, done.err
    content = json.loads(Path("bench/bench.json").read_text(encoding="utf-8"))
    own = [point for point in content["points"] if point["width"] == 16]
    assert {point["technique"] for point in own} == {"indirect.talk"}
    assert {point["swept"] for point in own} == {"", "c_height", "side", "step_rad", "far_brightness"}
    assert {point["width"] for point in content["points"]} == {8, 16, 32}
    assert all(point["error"]["low"] <= point["error"]["value"] <= point["error"]["high"] for point in own)
    assert all(point["cost"]["seconds"]["value"] > 0 and 1 <= point["cost"]["frames"] <= 3 for point in own)
    assert [image["spp"] for image in content["traced"]][:4] == [1, 2, 4, 8]
    errors = [image["error"]["value"] for image in content["traced"]]
    assert errors[0] > errors[3] > 0
    assert content["slopes"][0]["exponent"]["value"] == pytest.approx(-0.5, abs=0.15)
    assert content["environment"]["variant"] == "llvm_ad_rgb"
    assert content["claims"][0] in done.out
    assert "indirect.talk" in done.out
    assert "path tracer: error falls as spp^" in done.out
    assert Path("bench/index.html").exists()
    assert not Path("bench", PARTIAL).exists()
    Path("bench/index.html").unlink()
    again = lightgauge("bench", "--from", "bench/bench.json", "-o", "bench")
    assert (again.status, again.out.strip()) == (0, "Page: bench/index.html")
    assert Path("bench/index.html").exists()


def test_what_was_measured_before_an_interruption_is_not_measured_again(
    bench: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from comparisons.answers import bench as answers

    def broken(*whatever: Any) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(answers, "_bench", broken)
        assert bench("--size", "8x6", "--only", "points").status == 130
    assert Path("bench", PARTIAL).exists()
    done = bench("--size", "8x6", "--only", "points")
    assert done.status == 0
    assert "measured before" in done.out
    assert "doubt: 1 of 1 parts were measured by a run that was broken off" in done.out


def test_what_is_kept_goes_by_all_that_it_depends_on() -> None:
    def key(size: str = "8x6", keep: str = "indirect.talk", seconds: float = 1.0) -> str:
        asked = Asked(("indirect",), ("small-room-knot",), keep, size, Pace(seconds, 9), ("points",))
        (part,) = parts_of(asked)
        return part.key

    assert key() == key()
    assert len({key(), key(size="6x8"), key(keep="indirect.probe"), key(seconds=2.0)}) == 4


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["nothing"], "'nothing' names no effect; allowed are indirect-light, eye"),
        (["--size", "12"], "--size is '12'; allowed is a width and a height"),
        (["--size", "0x12"], "--size is '0x12'"),
        (["--size", "99999x12"], "each from 1 to 16384"),
        (["--frames", "0"], "--frames is 0"),
        (["--seconds-per-point", "inf"], "--seconds-per-point is inf"),
        (["eye", "--scene", "shadow-room"], "no technique of eye on shadow-room is judged there"),
        (["-k", "no.such"], "There is nothing to measure: no technique of indirect-light, eye"),
        (["--scene", "no-such"], "no-such"),
        (["--from", "no-such.json"], "'no-such.json' cannot be read as a benchmark"),
    ],
)
def test_bad_input_is_refused_in_a_paragraph(
    here: Path, lightgauge: Callable[..., Any], options: list[str], message: str
) -> None:
    done = lightgauge("bench", *options)
    assert done.status == 3
    assert message in done.err
    assert "Traceback" not in done.err


def test_a_json_that_is_no_benchmark_is_refused(here: Path, lightgauge: Callable[..., Any]) -> None:
    for text in ("[]", "{}", '{"schema": 99, "points": []}'):
        Path("other.json").write_text(text, encoding="utf-8")
        done = lightgauge("bench", "--from", "other.json")
        assert done.status == 3
        assert "is no benchmark of schema 1" in done.err


def test_an_unknown_variant_is_refused(
    write_scene: Callable[..., Path], lightgauge: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    write_scene()
    monkeypatch.setenv("LIGHTGAUGE_VARIANT", "cuda")
    done = lightgauge("bench", "--scene", "tiny.toml", "--only", "points")
    assert done.status == 3
    assert "LIGHTGAUGE_VARIANT is 'cuda'; allowed are" in done.err


def test_the_machine_is_described_and_doubts_about_it_are_told() -> None:
    found = machine()
    assert found["cpu"]
    assert found["load_average"] >= 0
    quiet = found | {"cpu_count": 4, "load_average": 0.0, "variant": "llvm_ad_rgb"}
    assert list(doubts(quiet, is_software=True)) == []
    busy = list(doubts(quiet | {"load_average": 4 * BUSY + 0.1}, is_software=True))
    assert len(busy) == 1
    assert "busy" in busy[0]
    mixed = list(doubts(quiet, is_software=False))
    assert len(mixed) == 2
    assert "A GPU ran the techniques, the processor the path tracer" in mixed[0]
    (clocks,) = doubts(quiet | {"variant": "cuda_ad_rgb"}, is_software=False)
    assert "path tracing by the wall clock" in clocks
