"""The FMU in two further importers, each with a loader of its own: libcosim with FMI Library, ecos with fmi4c.

fmpy, the first, is in test_export_fmu.py.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from test_estimate import steady_drive
from test_export_fmu import INPUTS, LEFT_HAND, bits

import oncenter as oc
from oncenter import export
from oncenter.export import binaries
from oncenter.signals import Signals


@pytest.fixture(scope="module", autouse=True)
def own_compiler() -> Iterator[None]:
    """The importers load this machine's binary alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(binaries, "has_zig", lambda: False)
        yield


@pytest.fixture(scope="module")
def drive() -> Signals:
    """Three minutes that begin at 0 and step evenly, as importers do."""
    given = steady_drive(minutes=3.0)
    table = given.table.with_columns(time_s=np.arange(given.table.height) * (1.0 / given.rate_hz))
    return Signals(table, given.sources, given.rate_hz, given.log)


def inputs_of(drive: Signals) -> dict[str, list[float]]:
    return {name: drive.table[column].to_list() for column, name in INPUTS.items() if column in drive.table.columns}


def imported(package: str) -> Any:
    """The package, or a skip that says why. ecos loads a library that Debian has in libtbb12."""
    try:
        return __import__(package, fromlist=["*"])
    except (ImportError, OSError) as error:
        pytest.skip(f"a second importer is missing ({error}): make fmu")


def test_libcosim_simulates_a_drive_to_the_same_offset(drive: Signals, tmp_path: Path) -> None:
    imported("libcosimpy")
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    path = export.write_fmu(LEFT_HAND, tmp_path / "truck.fmu", fmi=2)
    references = {v.name: v.valueReference for v in fmpy.read_model_description(str(path)).modelVariables}
    execution = CosimExecution.from_step_size(step_size=round(1e9 / drive.rate_hz))
    truck = execution.add_local_slave(CosimLocalSlave(fmu_path=str(path), instance_name="truck"))
    manipulator, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(manipulator)
    execution.add_observer(observer)
    assert execution.real_initial_value(truck, references["rate_hz"], drive.rate_hz)
    inputs = inputs_of(drive)
    for row in zip(*inputs.values(), strict=True):
        assert manipulator.slave_real_values(truck, [references[name] for name in inputs], list(row))
        assert execution.step()
    offset, duration = observer.last_real_values(truck, [references["offset"], references["duration_time"]])
    answer = oc.offset(drive, LEFT_HAND)
    assert duration == answer.duration_s
    assert bits(offset) == bits(answer.offset.value)


@pytest.mark.parametrize("fmi", [2, 3])
def test_ecos_simulates_a_drive_to_the_same_offset(fmi: int, drive: Signals, tmp_path: Path) -> None:
    ecos = imported("ecospy")
    path = export.write_fmu(LEFT_HAND, tmp_path / "truck.fmu", fmi=2 if fmi == 2 else 3)
    structure = ecos.EcosSimulationStructure()
    structure.add_model("truck", str(path))
    structure.add_parameter_set("start", {"truck::rate_hz": float(drive.rate_hz)})
    inputs = inputs_of(drive)
    with ecos.EcosSimulation(structure=structure, step_size=1.0 / drive.rate_hz) as simulation:
        simulation.init(parameter_set="start")
        for row in zip(*inputs.values(), strict=True):
            for name, value in zip(inputs, row, strict=True):
                simulation.set_real(f"truck::{name}", value)
            simulation.step()
        offset, duration = simulation.get_real("truck::offset"), simulation.get_real("truck::duration_time")
    answer = oc.offset(drive, LEFT_HAND)
    assert duration == answer.duration_s
    assert bits(offset) == bits(answer.offset.value)
