"""KCD, SYM and ARXML describe the same network as the DBC; a hostile file is refused in one line."""

from __future__ import annotations

from pathlib import Path

import cantools
import numpy as np
import pytest
from mutated_text import mutated
from test_invented_network import SIGNALS, TRUCK, dbc, log, refusal
from test_mutated_files import one_line

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.read.database_file import read_database

UNITS = ("deg", "deg/s", "km/h", "m/s^2")
LAYOUTS = (  # message, identifier, signal, first bit, factor, unit
    ("STEERING", 256, "SteerAng", 0, 0.1, "deg"),
    ("DYNAMICS", 257, "YawRt", 0, 0.01, "deg/s"),
    ("DYNAMICS", 257, "VehSpd", 16, 0.01, "km/h"),
    ("DYNAMICS", 257, "LatAccel", 32, 0.001, "m/s^2"),
)


def arxml() -> str:
    """A file as AUTOSAR 4 lays a network: cluster, frames, PDUs, signals, conversions and units are parts apart."""

    def element(tag: str, name: str, inner: str) -> str:
        return f"<{tag}><SHORT-NAME>{name}</SHORT-NAME>{inner}</{tag}>"

    messages = dict.fromkeys((message, identifier) for message, identifier, *_ in LAYOUTS)
    frames = "".join(
        element(
            "CAN-FRAME",
            message,
            "<FRAME-LENGTH>8</FRAME-LENGTH><PDU-TO-FRAME-MAPPINGS>"
            + element(
                "PDU-TO-FRAME-MAPPING",
                "M",
                f'<PDU-REF DEST="I-SIGNAL-I-PDU">/net/{message}_pdu</PDU-REF><START-POSITION>0</START-POSITION>',
            )
            + "</PDU-TO-FRAME-MAPPINGS>",
        )
        for message, _ in messages
    )
    pdus = "".join(
        element(
            "I-SIGNAL-I-PDU",
            f"{message}_pdu",
            "<LENGTH>8</LENGTH><I-SIGNAL-TO-PDU-MAPPINGS>"
            + "".join(
                element(
                    "I-SIGNAL-TO-I-PDU-MAPPING",
                    f"{name}_map",
                    f'<I-SIGNAL-REF DEST="I-SIGNAL">/net/{name}</I-SIGNAL-REF>'
                    "<PACKING-BYTE-ORDER>MOST-SIGNIFICANT-BYTE-LAST</PACKING-BYTE-ORDER>"
                    f"<START-POSITION>{first}</START-POSITION>",
                )
                for of, _, name, first, _, _ in LAYOUTS
                if of == message
            )
            + "</I-SIGNAL-TO-PDU-MAPPINGS>",
        )
        for message, _ in messages
    )
    signed = element(
        "SW-BASE-TYPE", "SINT16", "<BASE-TYPE-SIZE>16</BASE-TYPE-SIZE><BASE-TYPE-ENCODING>2C</BASE-TYPE-ENCODING>"
    )
    signals = "".join(
        element(
            "I-SIGNAL",
            name,
            "<LENGTH>16</LENGTH><NETWORK-REPRESENTATION-PROPS><SW-DATA-DEF-PROPS-VARIANTS><SW-DATA-DEF-PROPS-CONDITIONAL>"
            '<BASE-TYPE-REF DEST="SW-BASE-TYPE">/net/SINT16</BASE-TYPE-REF>'
            "</SW-DATA-DEF-PROPS-CONDITIONAL></SW-DATA-DEF-PROPS-VARIANTS></NETWORK-REPRESENTATION-PROPS>"
            f'<SYSTEM-SIGNAL-REF DEST="SYSTEM-SIGNAL">/net/{name}_sys</SYSTEM-SIGNAL-REF>',
        )
        + element(
            "SYSTEM-SIGNAL",
            f"{name}_sys",
            "<PHYSICAL-PROPS><SW-DATA-DEF-PROPS-VARIANTS><SW-DATA-DEF-PROPS-CONDITIONAL>"
            f'<COMPU-METHOD-REF DEST="COMPU-METHOD">/net/{name}_compu</COMPU-METHOD-REF>'
            f'<UNIT-REF DEST="UNIT">/net/{name}_unit</UNIT-REF>'
            "</SW-DATA-DEF-PROPS-CONDITIONAL></SW-DATA-DEF-PROPS-VARIANTS></PHYSICAL-PROPS>",
        )
        + element(
            "COMPU-METHOD",
            f"{name}_compu",
            "<CATEGORY>LINEAR</CATEGORY><COMPU-INTERNAL-TO-PHYS><COMPU-SCALES><COMPU-SCALE><COMPU-RATIONAL-COEFFS>"
            f"<COMPU-NUMERATOR><V>0</V><V>{factor}</V></COMPU-NUMERATOR><COMPU-DENOMINATOR><V>1</V></COMPU-DENOMINATOR>"
            "</COMPU-RATIONAL-COEFFS></COMPU-SCALE></COMPU-SCALES></COMPU-INTERNAL-TO-PHYS>",
        )
        + element("UNIT", f"{name}_unit", f"<DISPLAY-NAME>{unit}</DISPLAY-NAME>")
        for _, _, name, _, factor, unit in LAYOUTS
    )
    triggerings = "".join(
        element(
            "CAN-FRAME-TRIGGERING",
            f"{message}_trigger",
            f'<FRAME-REF DEST="CAN-FRAME">/net/{message}</FRAME-REF><CAN-ADDRESSING-MODE>STANDARD</CAN-ADDRESSING-MODE>'
            f"<IDENTIFIER>{identifier}</IDENTIFIER>",
        )
        for message, identifier in messages
    )
    cluster = element(
        "CAN-CLUSTER",
        "bus",
        "<CAN-CLUSTER-VARIANTS><CAN-CLUSTER-CONDITIONAL><BAUDRATE>500000</BAUDRATE><PHYSICAL-CHANNELS>"
        + element("CAN-PHYSICAL-CHANNEL", "channel", f"<FRAME-TRIGGERINGS>{triggerings}</FRAME-TRIGGERINGS>")
        + "</PHYSICAL-CHANNELS></CAN-CLUSTER-CONDITIONAL></CAN-CLUSTER-VARIANTS>",
    )
    package = element("AR-PACKAGE", "net", f"<ELEMENTS>{cluster}{frames}{pdus}{signals}{signed}</ELEMENTS>")
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<AUTOSAR xmlns="http://autosar.org/schema/r4.0">'
        f"<AR-PACKAGES>{package}</AR-PACKAGES></AUTOSAR>"
    )


def as_kind(kind: str) -> str:
    """The invented network, converted by cantools where it can write that."""
    if kind == "arxml":
        return arxml()
    database = cantools.database.load_string(dbc(*UNITS), "dbc")
    return {"dbc": lambda: dbc(*UNITS), "kcd": database.as_kcd_string, "sym": database.as_sym_string}[kind]()


@pytest.mark.parametrize("kind", ["kcd", "sym", "arxml", "KCD"])
def test_every_database_format_describes_the_same_network(kind: str, tmp_path: Path) -> None:
    (tmp_path / "drive.log").write_text(log())
    (tmp_path / "truck.toml").write_text(TRUCK + SIGNALS)
    for each in ("dbc", kind):
        (tmp_path / f"net.{each}").write_text(as_kind(each.lower()), encoding="utf-8")
    truck = oc.vehicle(tmp_path / "truck.toml")
    by_dbc, other = (
        oc.read(tmp_path / "drive.log", vehicle=truck, dbc=[tmp_path / f"net.{each}"]) for each in ("dbc", kind)
    )
    assert set(other.sources) == {"steering_wheel_angle", "yaw_rate", "vehicle_speed", "lateral_acceleration"}
    for name in by_dbc.table.columns:
        assert np.allclose(other.table[name], by_dbc.table[name], rtol=0, atol=1e-9, equal_nan=True), name


LAUGHS = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10 if k else "ha"}">' for k in range(12))
HARM = {
    "laughs.kcd": f"<!DOCTYPE NetworkDefinition [{LAUGHS}]><NetworkDefinition>&l11;</NetworkDefinition>",
    "file.arxml": '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/hostname">]><AUTOSAR>&x;</AUTOSAR>',
    "address.kcd": '<!DOCTYPE a PUBLIC "x" "http://127.0.0.1:9/x.dtd"><a/>',
}


@pytest.mark.parametrize("name", HARM)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_a_document_type_is_refused_before_entities_are_expanded(name: str, encoding: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(HARM[name], encoding=encoding)
    with pytest.raises(OncenterError, match=rf"^the database {name} has a document type \(<!DOCTYPE>\)") as refused:
        read_database(tmp_path / name)
    assert (refused.value.code, refused.value.exit_code) == ("bad_dbc", 2)


def test_an_endless_database_is_refused_in_one_line(tmp_path: Path) -> None:
    huge = {
        "deep.kcd": "<a>" * 100_000 + "</a>" * 100_000,
        "wide.kcd": as_kind("kcd").replace('offset="16"', 'offset="1600000000"'),
        "long.arxml": arxml().replace("<START-POSITION>32<", "<START-POSITION>0x7fffffff<"),
        "long.sym": as_kind("sym").replace("Len=8", "Len=800000000"),
        "many.sym": as_kind("sym").replace("ID=100h", "ID=100h-7FFFFFFFh"),
        "open.arxml": arxml()[:-30],
        "none.kcd": "STEERING",
    }
    for name, text in huge.items():
        assert text not in (as_kind("kcd"), as_kind("sym"), arxml()), name
        (tmp_path / name).write_text(text, encoding="utf-8")
        with pytest.raises(OncenterError) as refused:
            read_database(tmp_path / name)
        assert one_line(refused.value) and f"database {name}" in str(refused.value), str(refused.value)


@pytest.mark.parametrize("kind", ["kcd", "sym", "arxml"])
def test_a_mutated_database_is_read_or_refused_in_one_line(kind: str, tmp_path: Path) -> None:
    original, taken = as_kind(kind).encode(), 0
    for seed in range(60):
        file = tmp_path / f"seed{seed}.{kind}"
        file.write_bytes(mutated(original, seed))
        try:
            taken += bool(read_database(file).messages)
        except OncenterError as refused:
            assert one_line(refused), (seed, refused)
    assert taken


def test_a_file_that_is_not_a_database_is_refused_by_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "drive.log").write_text(log())
    (tmp_path / "net.arxml").write_text("<AUTOSAR/>")
    said = refusal(
        ["offset", str(tmp_path / "drive.log"), "--vehicle", "scania_r730_4x2", "--dbc", str(tmp_path / "net.arxml")],
        capsys,
    )
    assert "cannot read the database net.arxml" in said


@pytest.mark.parametrize("category", ["RAT_FUNC", "TAB_NOINTP"])
def test_an_unsupported_conversion_leaves_its_signal_out(category: str, tmp_path: Path) -> None:
    """Otherwise its raw values would be used as degrees."""
    (tmp_path / "drive.log").write_text(log())
    (tmp_path / "truck.toml").write_text(TRUCK + SIGNALS)
    (tmp_path / "net.arxml").write_text(
        arxml().replace(
            "<SHORT-NAME>YawRt_compu</SHORT-NAME><CATEGORY>LINEAR<",
            f"<SHORT-NAME>YawRt_compu</SHORT-NAME><CATEGORY>{category}<",
        )
    )
    signals = oc.read(tmp_path / "drive.log", vehicle=oc.vehicle(tmp_path / "truck.toml"), dbc=[tmp_path / "net.arxml"])
    assert set(signals.sources) == {"steering_wheel_angle", "vehicle_speed", "lateral_acceleration"}
    assert any(note.startswith("yaw_rate: DYNAMICS.YawRt has an unusable scale") for note in signals.notes)
