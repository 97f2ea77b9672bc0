"""The registry of techniques: one module each, named here and imported when asked for."""

import difflib
import importlib
from pathlib import Path

from realtime.technique import Technique
from scenes.errors import InputError

MODULES = {
    "raster.depth": "realtime.techniques.raster",
    "raster.normal": "realtime.techniques.raster",
    "raster.albedo": "realtime.techniques.raster",
    "raster.coverage": "realtime.techniques.raster",
    "indirect.talk": "realtime.techniques.indirect_talk",
    "indirect.probe": "realtime.techniques.indirect_probe",
    "indirect.irradiance": "realtime.techniques.indirect_irradiance",
}


def technique(name: str) -> Technique:
    """Raises InputError for an unknown name."""
    if name not in MODULES:
        close = difflib.get_close_matches(name, MODULES, 1)
        hint = f" Did you mean '{close[0]}'?" if close else ""
        raise InputError(f"Unknown technique '{name}'. Known: {', '.join(MODULES)}.{hint}")
    found: Technique = importlib.import_module(MODULES[name]).TECHNIQUES[name]
    return found


def source_files(root: Path) -> list[Path]:
    """All files under the package's folder that an image may depend on."""
    return sorted([*root.rglob("*.py"), *(path for path in root.rglob("glsl/**/*") if path.is_file())])
