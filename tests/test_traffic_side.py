"""The side of traffic by the positions of a log: right or unknown, and never wrong. It is in the answer, and no
position is."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_findings import example_on_page
from test_report import Parsed
from truck_rows import DAY_S, MONDAY_S, drive_row

import oncenter as oc
from oncenter import _core
from oncenter.fleet.tables import DRIVES, TRUCKS
from oncenter.memory import TruckMemory, offset_with_memory
from oncenter.offset.run import outputs_of
from oncenter.offset.traffic_side import with_traffic_side
from oncenter.report.page import page
from oncenter.signals import Signals, Source
from oncenter.traffic_side import Side, side_at, side_of
from oncenter.truck.events import ANOTHER_TRUCK, Event
from oncenter.truck.now import CROWN, of_one_side, priors_of_filter, truck_now
from oncenter.truck.priors import priors_of
from oncenter.vehicle import Vehicle, vehicle_from

M_PER_DEG = 111_195.0
# Latitude and longitude of cities far from any border between both sides.
LEFT = {
    "London": (51.51, -0.13),
    "Birmingham": (52.48, -1.9),
    "Glasgow": (55.86, -4.25),
    "Belfast": (54.6, -5.93),
    "Dublin": (53.35, -6.26),
    "Cork": (51.9, -8.47),
    "Valletta": (35.9, 14.51),
    "Nicosia": (35.17, 33.36),
    "Tokyo": (35.68, 139.69),
    "Osaka": (34.69, 135.5),
    "Sapporo": (43.06, 141.35),
    "Naha": (26.21, 127.68),
    "Bangkok": (13.76, 100.5),
    "Chiang Mai": (18.79, 98.98),
    "Hat Yai": (7.01, 100.47),
    "Kuala Lumpur": (3.14, 101.69),
    "Johor Bahru": (1.49, 103.74),
    "Singapore": (1.35, 103.82),
    "Jakarta": (-6.2, 106.85),
    "Dili": (-8.56, 125.57),
    "Port Moresby": (-9.44, 147.18),
    "Delhi": (28.61, 77.21),
    "Mumbai": (19.08, 72.88),
    "Dhaka": (23.81, 90.41),
    "Karachi": (24.86, 67.01),
    "Kathmandu": (27.72, 85.32),
    "Colombo": (6.93, 79.86),
    "Nairobi": (-1.29, 36.82),
    "Kampala": (0.32, 32.58),
    "Dar es Salaam": (-6.79, 39.2),
    "Lusaka": (-15.39, 28.32),
    "Lilongwe": (-13.96, 33.79),
    "Harare": (-17.83, 31.05),
    "Maputo": (-25.97, 32.57),
    "Windhoek": (-22.56, 17.08),
    "Gaborone": (-24.65, 25.91),
    "Johannesburg": (-26.2, 28.05),
    "Cape Town": (-33.92, 18.42),
    "Port Louis": (-20.16, 57.5),
    "Georgetown": (6.8, -58.16),
    "Paramaribo": (5.85, -55.2),
    "Kingston": (17.97, -76.79),
    "Nassau": (25.05, -77.35),
    "Christiansted": (17.73, -64.75),
    "Sydney": (-33.87, 151.21),
    "Perth": (-31.95, 115.86),
    "Auckland": (-36.85, 174.76),
    "Suva": (-18.14, 178.44),
    "Apia": (-13.83, -171.76),
}
RIGHT = {
    "Stockholm": (59.33, 18.07),
    "Oslo": (59.91, 10.75),
    "Copenhagen": (55.68, 12.57),
    "Reykjavik": (64.15, -21.94),
    "Berlin": (52.52, 13.4),
    "Rotterdam": (51.92, 4.48),
    "Paris": (48.86, 2.35),
    "Lille": (50.63, 3.07),
    "Gibraltar": (36.14, -5.35),
    "Las Palmas": (28.12, -15.43),
    "Palermo": (38.12, 13.36),
    "Istanbul": (41.01, 28.98),
    "Cairo": (30.04, 31.24),
    "Lagos": (6.52, 3.38),
    "Kinshasa": (-4.32, 15.31),
    "Luanda": (-8.84, 13.23),
    "Addis Ababa": (9.01, 38.75),
    "Juba": (4.85, 31.6),
    "Bujumbura": (-3.38, 29.36),
    "Antananarivo": (-18.88, 47.51),
    "Saint-Denis": (-20.88, 55.45),
    "Dubai": (25.2, 55.27),
    "Kabul": (34.56, 69.21),
    "Moscow": (55.76, 37.62),
    "Vladivostok": (43.12, 131.89),
    "Beijing": (39.9, 116.4),
    "Guangzhou": (23.13, 113.26),
    "Taipei": (25.03, 121.57),
    "Seoul": (37.57, 126.98),
    "Busan": (35.18, 129.08),
    "Hanoi": (21.03, 105.85),
    "Phnom Penh": (11.56, 104.92),
    "Yangon": (16.84, 96.17),
    "Manila": (14.6, 120.98),
    "Port Vila": (-17.73, 168.32),
    "Noumea": (-22.28, 166.46),
    "New York": (40.71, -74.01),
    "Los Angeles": (34.05, -118.24),
    "Anchorage": (61.22, -149.9),
    "Honolulu": (21.31, -157.86),
    "San Juan": (18.47, -66.11),
    "Mexico City": (19.43, -99.13),
    "Havana": (23.11, -82.37),
    "Caracas": (10.48, -66.9),
    "Cayenne": (4.92, -52.31),
    "Manaus": (-3.12, -60.02),
    "Sao Paulo": (-23.55, -46.63),
    "Buenos Aires": (-34.6, -58.38),
}
# Near a border between both sides, with the side that an answer may have.
NEAR_A_BORDER: dict[str, tuple[float, float, Side]] = {
    "Dover": (51.13, 1.31, "left"),
    "Folkestone": (51.08, 1.17, "left"),
    "Calais": (50.95, 1.86, "right"),
    "Saint Helier": (49.19, -2.11, "left"),
    "Cherbourg": (49.63, -1.62, "right"),
    "Newry": (54.18, -6.34, "left"),
    "Hong Kong": (22.3, 114.17, "left"),
    "Shenzhen": (22.54, 114.06, "right"),
    "Macau": (22.19, 113.54, "left"),
    "Zhuhai": (22.27, 113.57, "right"),
    "Nong Khai": (17.88, 102.74, "left"),
    "Vientiane": (17.97, 102.6, "right"),
    "Mae Sot": (16.71, 98.57, "left"),
    "Poipet": (13.66, 102.56, "right"),
    "Cox's Bazar": (21.43, 92.0, "left"),
    "Torkham": (34.13, 71.09, "right"),
    "Moyale": (3.53, 39.05, "right"),
    "Goma": (-1.68, 29.22, "right"),
    "Kigali": (-1.95, 30.06, "right"),
    "Kasumbalesa": (-12.23, 27.8, "right"),
    "Chililabombwe": (-12.37, 27.83, "left"),
    "Oshikango": (-17.4, 15.9, "left"),
    "Lethem": (3.38, -59.8, "left"),
    "Bonfim": (3.36, -59.83, "right"),
    "Saint-Laurent": (5.5, -54.03, "right"),
    "Castries": (14.01, -60.99, "left"),
    "Charlotte Amalie": (18.34, -64.93, "left"),
    "Culebra": (18.3, -65.3, "right"),
    "Marigot": (18.07, -63.08, "right"),
    "Anguilla": (18.22, -63.06, "left"),
    "Wakkanai": (45.4, 141.67, "left"),
    "Gibraltar": (36.14, -5.35, "right"),
}
NOWHERE = {
    "mid Channel": (51.03, 1.55),
    "North Sea": (55.5, 3.5),
    "Bay of Biscay": (45.5, -5.0),
    "Strait of Korea": (34.5, 130.3),
    "Bass Strait": (-39.7, 145.3),
    "Atlantic": (45.0, -30.0),
    "Gulf of Guinea": (0.0, 0.0),
    "South Pole": (-90.0, 0.0),
}


def moving(latitude_deg: Any, longitude_deg: Any, *, speed_m_s: Any = 20.0, still_m_s: float | None = None) -> Signals:
    """Five minutes to the north from a position; `still_m_s` is the speed over ground where it is another one."""
    time = np.arange(0.0, 300.0, 0.1)
    over_ground = speed_m_s if still_m_s is None else still_m_s
    columns = {
        "time_s": time,
        "vehicle_speed_m_s": np.full(len(time), speed_m_s),
        "latitude_deg": latitude_deg + time * over_ground / M_PER_DEG,
        "longitude_deg": np.full(len(time), longitude_deg),
    }
    return Signals(columns, {}, 10.0, "drive")


@pytest.mark.parametrize(("side", "place"), [*(("left", each) for each in LEFT), *(("right", each) for each in RIGHT)])
def test_a_city_far_from_any_border_between_both_sides_has_its_side(side: Side, place: str) -> None:
    position = (LEFT if side == "left" else RIGHT)[place]
    assert side_at(*position) == side and side_of([moving(*position)]) == side


@pytest.mark.parametrize("place", NEAR_A_BORDER)
def test_the_side_near_a_border_is_right_or_unknown(place: str) -> None:
    latitude, longitude, side = NEAR_A_BORDER[place]
    assert side_at(latitude, longitude) in (side, None)
    assert side_of([moving(latitude, longitude)]) in (side, None)


@pytest.mark.parametrize("place", NOWHERE)
def test_there_is_no_side_at_sea(place: str) -> None:
    assert side_at(*NOWHERE[place]) is None


@pytest.mark.parametrize(
    "position",
    [
        (float("nan"), 13.4),
        (52.5, float("nan")),
        (91.0, 13.4),
        (52.5, 181.0),
        (-210.0, -210.0),
        (0.0, 0.0),
        (0.0, 32.6),  # Uganda, if it were one
        (52.5, 0.0),  # England, if it were one
    ],
)
def test_what_a_receiver_without_a_position_sends_has_no_side(position: tuple[float, float]) -> None:
    assert side_of([moving(*position, still_m_s=0.0)]) is None
    latitude, longitude = position
    if abs(latitude) > 0.0:
        assert side_of([moving(latitude, longitude)]) is None


def test_a_position_that_does_not_move_with_the_truck_has_no_side() -> None:
    assert side_of([moving(52.5, 13.4, still_m_s=0.0)]) is None  # frozen
    assert side_of([moving(52.5, 13.4, still_m_s=1.0)]) is None  # drifting
    assert side_of([moving(52.5, 13.4, still_m_s=200.0)]) is None  # of a plane


def test_a_truck_that_stands_on_a_ferry_or_train_has_no_side() -> None:
    assert side_of([moving(53.3, -4.4, speed_m_s=0.0, still_m_s=10.0)]) is None
    assert side_of([moving(53.3, -4.4, speed_m_s=0.05, still_m_s=0.05)]) is None  # sensors at standstill
    assert side_of([moving(53.3, -4.4)]) == "left"


def test_a_single_jump_of_the_position_does_not_count() -> None:
    drive = moving(52.5, 13.4)
    for name in ("latitude_deg", "longitude_deg"):
        column = drive.columns[name].copy()
        column[600:605] = 51.5 if name.startswith("lat") else -0.1  # London
        drive = drive.replaced(columns={**drive.columns, name: column})
    assert side_of([drive]) == "right"


def test_drives_on_both_sides_have_no_side() -> None:
    left, right, unsure = moving(*LEFT["London"]), moving(*RIGHT["Paris"]), moving(51.1, 1.3)
    assert side_of([left, right]) is None and side_of([right, unsure]) is None
    assert side_of([left, left]) == "left"


def test_a_log_without_positions_has_no_side() -> None:
    drive = moving(52.5, 13.4)
    for name in drive.columns:
        if name != "time_s":
            rest = {key: column for key, column in drive.columns.items() if key != name}
            assert side_of([drive.replaced(columns=rest)]) is None
    assert side_of([]) is None


def test_a_drive_over_the_date_line_has_a_side() -> None:
    drive = moving(-16.8, 0.0)  # Taveuni in Fiji
    east = (179.99 + drive.columns["time_s"] * 20.0 / M_PER_DEG + 180.0) % 360.0 - 180.0
    latitude = np.full(len(east), -16.8)
    drive = drive.replaced(columns={**drive.columns, "longitude_deg": east, "latitude_deg": latitude})
    assert side_of([drive]) == "left"


def test_the_table_is_small_and_names_its_source() -> None:
    file = Path(oc.__file__).with_name("traffic_sides.txt")
    head = file.read_text(encoding="utf-8").splitlines()[:5]
    assert file.stat().st_size < 20_000
    assert "Natural Earth" in head[1] and "public domain" in head[1] and all(line.startswith("#") for line in head)


def truck(**given: Any) -> Vehicle:
    return vehicle_from({"wheelbase_m": 3.7, "steering_ratio": 19.3, "axle_layout": "4x2", **given}, "truck")


@cache
def driven(city: str | None) -> Signals:
    """A quarter of an hour of the thesis drive, in a city."""
    signals, truth = oc.simulate("thesis_drive", seed=3)
    rows = 90_000
    columns = {name: column[:rows] for name, column in signals.columns.items()}
    if city is None:
        return signals.replaced(columns=columns)
    latitude, longitude = {**LEFT, **RIGHT}[city]
    north, east = (truth.table[name].to_numpy()[:rows] / M_PER_DEG for name in ("north_m", "east_m"))
    columns["latitude_deg"] = latitude + north
    columns["longitude_deg"] = longitude + east / np.cos(np.radians(latitude))
    sources = {name: Source("column " + name, 1.0, 1, 0) for name in ("latitude", "longitude")}
    return signals.replaced(columns=columns, sources={**signals.sources, **sources})


@cache
def answered(city: str | None, side: str | None) -> oc.Answer:
    return oc.offset(driven(city), truck(**({} if side is None else {"traffic_side": side})))


def numbers(answer: oc.Answer) -> tuple[Any, ...]:
    return answer.offset, answer.offset_ci95_drive, answer.not_identifiable, answer.understeer_gradient, answer.backlash


@pytest.mark.parametrize(("city", "side"), [("Berlin", "right"), ("London", "left")])
def test_a_position_gives_the_answer_that_the_given_side_gives(city: str, side: str) -> None:
    by_position, given, unknown = answered(city, None), answered(None, side), answered(None, None)
    assert numbers(by_position) == numbers(given) != numbers(unknown)
    assert by_position.to_dict()["traffic_side"] == {"side": side, "by": "position"}
    assert given.to_dict()["traffic_side"] == {"side": side, "by": "vehicle file"}
    assert unknown.to_dict()["traffic_side"] == {"side": None, "by": None}
    assert f"traffic keeps {side}, by the positions in the log" in by_position.notes


def test_a_position_that_contradicts_the_vehicle_file_is_a_warning_and_neither_is_used() -> None:
    contradicted = answered("Berlin", "left")
    assert numbers(contradicted) == numbers(answered(None, None))
    assert contradicted.to_dict()["traffic_side"] == {"side": None, "by": None}
    found = [each for each in contradicted.findings if each.code == "traffic_side_contradicted"]
    assert [each.severity for each in found] == ["warning"]
    assert found[0].text == example_on_page("traffic_side_contradicted")
    agreeing = answered("Berlin", "right")
    assert "traffic_side_contradicted" not in {each.code for each in agreeing.findings}
    assert numbers(agreeing) == numbers(answered(None, "right"))


def test_an_axle_set_up_for_a_contradicted_side_has_no_known_pull() -> None:
    set_up = truck(traffic_side="left", set_up_for_crown=True)
    vehicle, found, _ = with_traffic_side(set_up, [moving(*RIGHT["Berlin"])])
    assert set_up.params["known_pull_m_s2"] < 0.0 and "known_pull_m_s2" not in vehicle.params
    assert vehicle.traffic_sign == 0.0 and len(found) == 1


def test_the_side_of_former_drives_counts_where_the_log_has_no_position() -> None:
    former = [drive_row(0.0, 2.0, side=-1.0), drive_row(1.0, 2.0, side=0.0)]
    drive = driven(None)
    assert with_traffic_side(truck(), [drive], former)[0].traffic_side_by == "former drives"
    assert with_traffic_side(truck(), [drive], former)[0].traffic_side == "left"
    assert with_traffic_side(truck(traffic_side="right"), [drive], former)[0].traffic_side == "right"
    assert with_traffic_side(truck(), [moving(*RIGHT["Berlin"])], former)[0].traffic_side == "right"
    another_truck = Event(MONDAY_S + 3.0 * DAY_S, ANOTHER_TRUCK)
    assert with_traffic_side(truck(), [drive], former, [another_truck])[0].traffic_side is None
    both = [*former, drive_row(2.0, 2.0, side=1.0)]
    assert with_traffic_side(truck(), [drive], both)[0].traffic_side is None


def test_a_memory_keeps_the_side_for_a_drive_without_a_position() -> None:
    first = replace(driven("London"), start_s=MONDAY_S)
    _, memory = offset_with_memory([first], truck(), TruckMemory("truck"))
    later = replace(driven(None), start_s=MONDAY_S + DAY_S)
    later = later.replaced(columns={**later.columns, "yaw_rate_rad_s": later.columns["yaw_rate_rad_s"] + 1e-4})
    answer, memory = offset_with_memory([later], truck(), memory)
    assert answer.to_dict()["traffic_side"] == {"side": "left", "by": "former drives"}
    assert [drive.row.side for drive in memory.drives] == [-1.0, -1.0]


def test_drives_without_a_side_have_that_of_all_others_of_the_truck() -> None:
    priors = priors_of(_core.default_params())
    known, unknown, other = (drive_row(float(day), 2.0, side=side) for day, side in enumerate((1.0, 0.0, -1.0)))
    assert truck_now([known, unknown], [], priors).own == truck_now([known, replace(unknown, side=1.0)], [], priors).own
    of_both = [known, unknown, other]
    assert list(of_one_side(of_both)) == of_both
    crown = priors_of_filter(priors, of_both)["variance"][CROWN]
    assert crown > priors_of_filter(priors, [known, other])["variance"][CROWN]


def test_no_answer_and_no_page_has_a_position() -> None:
    answer = answered("Berlin", None)
    visible = " ".join(Parsed(page(answer, outputs_of(answer))).visible.split())
    assert "driven on the right (by position)" in visible
    tables = repr([*DRIVES, *TRUCKS])
    assert not re.search("latitude|longitude|position", tables)
    for text in (answer.to_json(), str(answer), visible):
        assert not re.search(r"\b52\.[45]\d|\b13\.[34]\d|° [NS]", text)


def test_an_answer_of_the_angle_uses_the_position() -> None:
    by_position, given, unknown = (
        oc.angle(driven(city), truck(**side), sensor_lost_at=600.0)["steering_wheel_angle_rad"].to_numpy()
        for city, side in (("Berlin", {}), (None, {"traffic_side": "right"}), (None, {}))
    )
    assert np.array_equal(by_position, given) and not np.array_equal(by_position, unknown)
