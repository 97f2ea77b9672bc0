"""The registry of quantities: one module each, named here and imported when asked for."""

import difflib
import importlib

from reference.quantity import Quantity
from scenes.errors import InputError

MODULES = {
    "depth": "reference.quantities.geometry",
    "normal": "reference.quantities.geometry",
    "coverage": "reference.quantities.geometry",
    "albedo": "reference.quantities.geometry",
    "indirect_radiance": "reference.quantities.indirect",
}


def quantity(name: str) -> Quantity:
    """Raises InputError for an unknown name."""
    if name not in MODULES:
        close = difflib.get_close_matches(name, MODULES, 1)
        hint = f" Did you mean '{close[0]}'?" if close else ""
        raise InputError(f"Unknown quantity '{name}'. Known: {', '.join(MODULES)}.{hint}")
    found: Quantity = importlib.import_module(MODULES[name]).QUANTITIES[name]
    return found
