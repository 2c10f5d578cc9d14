"""Writes src/oncenter/traffic_sides.txt, the side of traffic by cells of half a degree, from Natural Earth's borders.

Usage: make_traffic_sides.py COUNTRIES: `countries-10m.json` of the npm package world-atlas 2.0.2, which is Natural
Earth's map of countries at 1:10 million, version 4.1.0, as TopoJSON. Natural Earth is in the public domain.

A cell is left or right if it has land of that side, and none of the other side within 20 km. The margin contains the
errors of the map (5 km), of its drawing in steps of 0.05 deg (6 km) and of the position. Land is 5 km wider than the
map, so that no road at the coast is at sea.
"""

import json
import sys
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

TABLE = Path(__file__).parents[1] / "src" / "oncenter" / "traffic_sides.txt"
PER_DEG = 20  # steps of the drawing
PER_CELL = 10  # of them
MARGIN_KM, MAP_KM = 20.0, 5.0
KM_PER_DEG = 111.2
HEAD = """\
# Side of the road on which traffic keeps: L left, R right, . sea, no road, or near a border between both sides.
# Source: Natural Earth, countries at 1:10 million, version 4.1.0, naturalearthdata.com. Licence: public domain.
# The sides of the countries are common knowledge, listed in docs/make_traffic_sides.py, which writes this file.
# A line is half a degree of latitude, from the north pole; its runs begin at longitude -180: "12R" is 12 cells of
# half a degree on the right. The cells that a line does not have are ".".
"""
LEFT = """
Akrotiri; Anguilla; Antigua and Barb.; Ashmore and Cartier Is.; Australia; Bahamas; Bangladesh; Barbados; Bermuda;
Bhutan; Botswana; British Virgin Is.; Brunei; Cayman Is.; Cook Is.; Coral Sea Is.; Cyprus; Cyprus U.N. Buffer Zone;
Dhekelia; Dominica; Falkland Is.; Fiji; Grenada; Guernsey; Guyana; Hong Kong; India; Indian Ocean Ter.; Indonesia;
Ireland; Isle of Man; Jamaica; Japan; Jersey; Kenya; Kiribati; Lesotho; Macao; Malawi; Malaysia; Maldives; Malta;
Mauritius; Montserrat; Mozambique; N. Cyprus; Namibia; Nauru; Nepal; New Zealand; Niue; Norfolk Island; Pakistan;
Papua New Guinea; Pitcairn Is.; Saint Helena; Saint Lucia; Samoa; Seychelles; Siachen Glacier; Singapore; Solomon Is.;
South Africa; Sri Lanka; St. Kitts and Nevis; St. Vin. and Gren.; Suriname; Tanzania; Thailand; Timor-Leste; Tonga;
Trinidad and Tobago; Turks and Caicos Is.; Tuvalu; U.S. Virgin Is.; Uganda; United Kingdom; Zambia; Zimbabwe; eSwatini
"""
# Parts of the names of land without roads.
NO_ROADS = "Antarctic", "Bajo Nuevo", "Clipperton", "McDonald", "S. Geo.", "Scarborough", "Serranilla", "Spratly"

Mask = npt.NDArray[np.bool_]
Points = npt.NDArray[np.float64]


def countries(path: str) -> Iterator[tuple[str, list[list[Points]]]]:
    """Name and polygons of each country; a polygon is its rings, of longitude and latitude in deg."""
    topology = json.loads(Path(path).read_text(encoding="utf-8"))
    scale, start = (np.array(topology["transform"][name]) for name in ("scale", "translate"))
    arcs = [np.cumsum(np.array(arc), axis=0) * scale + start for arc in topology["arcs"]]

    def ring(of: list[int]) -> Points:
        return np.concatenate([arcs[k] if k >= 0 else arcs[~k][::-1] for k in of])

    for country in topology["objects"]["countries"]["geometries"]:
        polygons: list[Any] = country.get("arcs", [])
        polygons = [polygons] if country["type"] == "Polygon" else polygons
        yield country["properties"]["name"], [[ring(of) for of in polygon] for polygon in polygons]


def draw(polygon: list[Points], on: Mask) -> None:
    """Its outline, so that no island is too small, and its inside."""
    edges = np.concatenate([np.hstack([ring[:-1], ring[1:]]) for ring in polygon])
    for west, south, east, north in edges[np.abs(edges[:, 2] - edges[:, 0]) < 180.0]:
        steps = int(2 * PER_DEG * max(abs(east - west), abs(north - south))) + 2
        rows = (np.linspace(south, north, steps) + 90.0) * PER_DEG
        columns = (np.linspace(west, east, steps) + 180.0) * PER_DEG
        on[np.clip(rows.astype(int), 0, len(on) - 1), np.clip(columns.astype(int), 0, on.shape[1] - 1)] = True
    low, high = edges[:, [1, 3]].min(axis=1), edges[:, [1, 3]].max(axis=1)
    for row in range(max(int((low.min() + 90.0) * PER_DEG), 0), min(int((high.max() + 90.0) * PER_DEG) + 1, len(on))):
        latitude = (row + 0.5) / PER_DEG - 90.0
        west, south, east, north = edges[(low <= latitude) & (high > latitude)].T
        across = np.sort(west + (latitude - south) / (north - south) * (east - west))
        for begin, end in np.ceil((across.reshape(-1, 2) + 180.0) * PER_DEG - 0.5).astype(int):
            on[row, begin:end] = True


def wider(land: Mask, by_km: float) -> Mask:
    """The land and all that is within a distance of it."""
    steps = int(np.ceil(by_km / KM_PER_DEG * PER_DEG))
    grown = land.copy()
    for k in range(1, steps + 1):
        grown[k:] |= land[:-k]
        grown[:-k] |= land[k:]
    for row in np.flatnonzero(grown.any(axis=1)):
        latitude = abs((row + 0.5) / PER_DEG - 90.0) + 1.0
        reach = int(np.ceil(steps / max(np.cos(np.radians(latitude)), 0.05)))
        of_row = np.flatnonzero(grown[row])[:, None] + np.arange(-reach, reach + 1)
        grown[row, of_row % grown.shape[1]] = True
    return grown


def cells(land: Mask) -> Mask:
    """The cells that have any of it."""
    rows, columns = (length // PER_CELL for length in land.shape)
    has: Mask = np.any(land.reshape(rows, PER_CELL, columns, PER_CELL), axis=(1, 3))
    return has


def line(row: str) -> str:
    """The runs of a row of cells."""
    return "".join(f"{len(list(run))}{side}" for side, run in groupby(row))


def table(path: str) -> str:
    land = {side: np.zeros((180 * PER_DEG, 360 * PER_DEG), dtype=bool) for side in "LR"}
    on_left = {name.strip() for name in LEFT.replace("\n", " ").split(";")}
    for name, polygons in countries(path):
        for polygon in polygons if not any(part in name for part in NO_ROADS) else []:
            draw(polygon, land["L" if name in on_left else "R"])
    near, far = ({side: cells(wider(land[side], km)) for side in land} for km in (MAP_KM, MARGIN_KM))
    left, right = near["L"] & ~far["R"], near["R"] & ~far["L"]
    sides = np.where(left, "L", np.where(right, "R", "."))[::-1]
    return HEAD + "\n".join(line("".join(row).rstrip(".")) for row in sides).rstrip() + "\n"


if __name__ == "__main__":
    TABLE.write_text(table(sys.argv[1]), encoding="utf-8", newline="\n")
