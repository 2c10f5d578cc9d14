"""A part of a database that cannot be read is left out by name, and the rest is read."""

from __future__ import annotations

from pathlib import Path

import pytest
from drive_frames import START_S, Frame, candump, drive, identifier
from real_data import real_drive
from test_databases import UNITS, as_kind
from test_invented_network import SIGNALS, TRUCK, dbc, log

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.read import read
from oncenter.read.database_file import Database, read_database

ANGLE = ' SG_ SteerAng : 0|16@1- (0.1,0) [-800|800] "deg" ESP\n'
FLT_MAX = "340282346638528859811704183484516925440"
BROKEN = {  # one line each beside the signals of the network, and the name of the part that is left out
    "maximum": ('BO_ 300 WIDE: 8 X\n SG_ Wide : 0|64@1+ (1,0) [0|18446744073709551615] "" X\n', ""),
    "float_maximum": (f'BO_ 300 WIDE: 8 X\n SG_ Wide : 0|32@1- (1,0) [-{FLT_MAX}|{FLT_MAX}] "" X\n', ""),
    "left_over_values": ('VAL_ 256 Removed 0 "off" 1 "on" ;\nVAL_ 999 Gone 1 "on" ;\n', ""),
    "left_over_type": ("SIG_VALTYPE_ 256 Removed : 1;\n", ""),
    "comment": ('CM_ 256 "a comment of no kind";\nCM_ SG_ 256 SteerTorque "an inner "quote"";\n', "CM_ (line"),
    "values": ('VAL_ 256 SteerTorque 0.5 "half" ;\n', "VAL_ (line"),
    "no_bit_31": ('BO_ 1075196473 WIDE: 8 X\n SG_ Wide : 0|8@1+ (1,0) [0|1] "" X\n', "WIDE (DBC: Standard frame id"),
    "digit": ('BO_ 300 WIDE: 8 X\n SG_ 4Gear : 0|8@1+ (1,0) [0|1] "" X\n', ""),
    "umlaut": ('BO_ 300 Räder: 8 X\n SG_ Länge-1 : 0|8@1+ (1,0) [0|1] "" X\n', ""),
    "no_layout": ('BO_ 300 WIDE: 8 X\n SG_ Wide : 0|8@1+ (1,0 [0|1] "" X\n', "WIDE.Wide (line"),
    "no_bits": ('BO_ 300 WIDE: 8 X\n SG_ Wide : 0|0@1+ (1,0) [0|1] "" X\n', "WIDE.Wide (DBC: The signal Wide length 0"),
    "no_length": ('BO_ 300 WIDE: X\n SG_ Wide : 0|8@1+ (1,0) [0|1] "" X\n', "WIDE (line"),
    "attribute": ('BA_ "GenMsgCycleTime" BO_ 256 10;\nBA_DEF_ BO_ "Cycle" INT 0;\n', ""),
    "no_receiver": ('BO_ 300 WIDE: 8 X\n SG_ Wide : 0|8@1+ (1,0) [0|1] ""\n', ""),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_a_line_that_cannot_be_read_leaves_out_only_what_it_describes(kind: str, tmp_path: Path) -> None:
    line, name = BROKEN[kind]
    (tmp_path / "drive.log").write_text(log())
    (tmp_path / "truck.toml").write_text(TRUCK + SIGNALS)
    for place, text in (("end", dbc(*UNITS) + line), ("begin", dbc(*UNITS).replace("BO_ 256", line + "\nBO_ 256", 1))):
        (tmp_path / f"{place}.dbc").write_text(text, encoding="utf-8")
        signals = read(
            tmp_path / "drive.log", vehicle=oc.vehicle(tmp_path / "truck.toml"), dbc=[tmp_path / f"{place}.dbc"]
        )
        assert set(signals.sources) == {"steering_wheel_angle", "yaw_rate", "vehicle_speed", "lateral_acceleration"}
        said = [note for note in signals.notes if note.startswith(f"{place}.dbc: left out, as it cannot be read: ")]
        assert len(said) == bool(name) and all(name in note for note in said), signals.notes


def test_a_name_that_cantools_does_not_accept_is_read_as_written(tmp_path: Path) -> None:
    text = 'BO_ 300 1CC-Räder: 8 X\n SG_ 4Gear : 0|8@1+ (1,0) [0|1] "" X\nVAL_ 300 4Gear 1 "on" ;\n'
    (tmp_path / "odd.dbc").write_text(text, encoding="utf-8")
    (message,) = read_database(tmp_path / "odd.dbc").messages
    assert (message.name, message.signals[0].name) == ("1CC-Räder", "4Gear")
    assert message.signals[0].choices == {1: "on"}


@pytest.mark.parametrize("layout", [ANGLE.replace("(0.1,0)", "(0,1,0)"), ANGLE.replace("16@1-", "0@1-")])
def test_an_assigned_signal_whose_definition_cannot_be_read_is_refused_by_name(tmp_path: Path, layout: str) -> None:
    (tmp_path / "drive.log").write_text(log())
    (tmp_path / "truck.toml").write_text(TRUCK + SIGNALS)
    text = dbc(*UNITS).replace(ANGLE.replace('"deg"', f'"{UNITS[0]}"'), layout)
    assert layout in text
    (tmp_path / "net.dbc").write_text(text)
    with pytest.raises(OncenterError, match=r"net\.dbc describes SteerAng, which \[signals\] names for") as refused:
        read(tmp_path / "drive.log", vehicle=oc.vehicle(tmp_path / "truck.toml"), dbc=[tmp_path / "net.dbc"])
    assert (refused.value.code, refused.value.exit_code) == ("bad_dbc", 2)


def test_a_signal_whose_multiplexer_or_number_type_cannot_be_read_is_left_out(tmp_path: Path) -> None:
    """Otherwise other bits or an integer would be taken for its values."""
    text = 'BO_ 300 WIDE: 8 X\n SG_ A : 0|32@1- (1,0) [0|0] "" X\n SG_ B m1 : 32|8@1+ (1,0) [0|0] "" X\n'
    text += ' SG_ Page M : 40|8@1+ (1,0 [0|0] "" X\n SG_ C : 48|8@1+ (1,0) [0|0] "" X\nSIG_VALTYPE_ 300 A : 9;\n'
    (tmp_path / "net.dbc").write_text(text)
    database = read_database(tmp_path / "net.dbc")
    assert [signal.name for signal in database.messages[0].signals] == ["C"]
    assert {each.name for each in database.not_read} >= {"WIDE.A", "WIDE.B", "WIDE.Page"}


def left_out(folder: Path, name: str, text: str) -> tuple[Database, set[str]]:
    (folder / name).write_text(text, encoding="utf-8")
    database = read_database(folder / name)
    return database, {each.name for each in database.not_read}


@pytest.mark.parametrize(
    ("kind", "written", "broken", "name"),
    [
        ("kcd", 'name="YawRt" offset="0"', 'name="YawRt" offset="first"', "DYNAMICS.YawRt"),
        ("kcd", 'id="0x101"', 'id="none"', "DYNAMICS"),
        ("sym", 'signed 16 /u:"deg/s"', 'signed 16, /u:"deg/s"', "DYNAMICS.YawRt"),
        ("sym", "ID=101h", "ID=10100000000h", "DYNAMICS"),
        ("arxml", "<IDENTIFIER>257<", "<IDENTIFIER>many<", "DYNAMICS_trigger"),
    ],
)
def test_a_broken_message_or_signal_of_another_format_is_left_out_by_name(
    kind: str, written: str, broken: str, name: str, tmp_path: Path
) -> None:
    text = as_kind(kind)
    assert written in text, text
    database, names = left_out(tmp_path, f"net.{kind}", text.replace(written, broken))
    assert names in ({name}, {name, name.rpartition(".")[2]})
    there = {f"{message.name}.{signal.name}" for message in database.messages for signal in message.signals}
    assert "STEERING.SteerAng" in there and not any(each == name or each.startswith(f"{name}.") for each in there)


def test_a_frame_goes_to_the_message_of_its_source_address_before_that_of_any(tmp_path: Path) -> None:
    layout = 'BO_ {} {}: 8 X\n SG_ steering_wheel_angle : {}|16@1- (0.1,0) [0|0] "deg" X\n'
    any_address, exact = layout.format(0x98FF01FE, "ANY", 16), layout.format(0x9CFF0121, "EXACT", 0)
    (tmp_path / "net.dbc").write_text(any_address + exact)
    data = (10).to_bytes(2, "little") + (20).to_bytes(2, "little") + bytes(4)
    frames = drive() + [Frame(START_S + k / 100, identifier(0xFF01, 0x21), data) for k in range(300)]
    (tmp_path / "drive.log").write_text(candump(frames))
    signals = read(tmp_path / "drive.log", dbc=[tmp_path / "net.dbc"], take={"steering_wheel_angle": "0x21"})
    assert signals.sources["steering_wheel_angle"].description.startswith("EXACT")


def test_the_frames_of_the_described_source_address_are_used_before_those_of_another(tmp_path: Path) -> None:
    text = f'BO_ {0x98FEF10E} TURN: 8 X\n SG_ yaw_rate : 0|16@1- (0.1,0) [0|0] "deg/s" X\n'
    (tmp_path / "net.dbc").write_text(text)
    frames = [
        Frame(START_S + k / 100, identifier(0xFEF1, address), value.to_bytes(2, "little") + bytes(6))
        for k in range(300)
        for address, value in ((0x0E, 10), (0x21, 900))
    ]
    (tmp_path / "drive.log").write_text(candump(frames))
    signals = read(tmp_path / "drive.log", dbc=[tmp_path / "net.dbc"])
    assert signals.sources["yaw_rate"].description == "TURN from 0x0E"


def test_of_the_databases_of_a_community_only_fragments_without_a_message_are_refused() -> None:
    folder = real_drive("opendbc")
    refused = {}
    for file in sorted(each for each in folder.rglob("*.dbc") if each.stat().st_size < 100_000):
        try:
            read_database(file)
        except OncenterError as error:
            refused[file.stem] = str(error)
    assert len(refused) == 7 and all("has no messages" in text for text in refused.values()), refused
