"""Quantities as they stand on axes, and which of many are shown."""

from __future__ import annotations


def symbol_of(name: str) -> str:
    """A quantity as it stands on an axis, in markup."""
    component, _, own = name.rpartition(".")
    symbols = {
        "theta_E": "θ_{E}",
        "gamma": "γ",
        "e1": "e_{1}",
        "e2": "e_{2}",
        "center_x": "x",
        "center_y": "y",
        "R_sersic": "R",
        "n_sersic": "n",
        "Rs": "R_{s}",
        "alpha_Rs": "α_{Rs}",
        "gamma1": "γ_{1}",
        "gamma2": "γ_{2}",
    }
    if not component:
        for prefix, symbol in (("gamma", "γ"), ("kappa", "κ"), ("omega", "ω"), ("F", "F"), ("G", "G")):
            head, _, place = own.partition("_")
            if head.rstrip("12") == prefix and place:
                digits = head[len(prefix) :]
                place = place.replace("_per_arcsec", "")
                return (
                    symbol + (f"_{{{digits}}}" if digits else "") + f"^{{{place.upper() if place == 'los' else place}}}"
                )
    return (f"{component.replace('_', ' ')} " if component else "") + symbols.get(own, own.replace("_", " "))


def most_physical(names: list[str]) -> list[str]:
    """Of many quantities eight: shears first, then the lens, then its source."""
    first = ["_los", "gamma", "theta_E", ".gamma", "lens", ".e", "R_sersic", "source"]

    def rank(i: int) -> tuple[int, int]:
        return next((place for place, word in enumerate(first) if word in names[i]), len(first)), i

    return [names[i] for i in sorted(sorted(range(len(names)), key=rank)[:8])]
