"""Usage errors in words: the error, and the command or option that helps."""

from __future__ import annotations

import re
from typing import Any

from oncenter.files.log_formats import SUFFIXES
from oncenter.nearest_name import did_you_mean

_HELP = {  # for an option or argument that is missing
    "--vehicle": "oncenter vehicle new truck.toml writes a vehicle file, oncenter vehicle list shows the shipped ones",
    "--vehicles": "give a folder of vehicle files: oncenter vehicle new DIR/VIN.toml writes one",
    "LOG…": "give a log, for example drive.mf4",
    "FILE": "give a vehicle file, for example truck.toml",
    "OUT.toml": "give the file to write, for example truck.toml",
    "LOG": "give a log, for example drive.mf4",
    "SCENARIO": "give the name of a scenario, for example thesis_drive",
}
_MEANT = {  # by what people type in place of a command
    "report": "offset LOG --report drive.html writes a report",
    "estimate": "offset LOG estimates the offset",
    "check": "signals LOG checks the signals of a log",
    "new": "vehicle new truck.toml writes a vehicle file",
    "run": "fleet run answers the logs of a fleet",
    "version": "--version prints the version",
}
_NO_NUMBER = "Input should be a valid number, unable to parse string as a number"  # of the check of a float


def usage_message(error: Any) -> str:
    """One line for a usage error of click or Typer."""
    message = str(error.format_message()).rstrip(".").replace("Value error, ", "")
    context = getattr(error, "ctx", None)
    command = re.fullmatch(r"No such command '(.*?)'.*", message)
    if command and context is not None:
        program, typed = context.command_path, command[1]
        if typed.lower().endswith(SUFFIXES):
            return f"there is no command '{typed}'; to answer this log: {program} offset {typed}"
        if typed in _MEANT:
            return f"there is no command '{typed}'; {program} {_MEANT[typed]}"
        meant = did_you_mean(typed, context.command.commands)
        return f"there is no command '{typed}'{meant}{'' if meant else f'; {program} -h lists all commands'}"
    option = re.match(r"No such option:? '?(-[\w-]+)'?", message)
    if option and context is not None:
        names = [name for parameter in context.command.params for name in parameter.opts if name.startswith("--")]
        meant = did_you_mean(option[1], names)
        return f"{context.command_path} has no option {option[1]}{meant or f'; {context.command_path} -h lists them'}"
    missing = re.match(r"Missing (?:option|argument|parameter):? '(.+?)'", message)
    if missing:
        advice = _HELP.get(missing[1]) or (f"{context.command_path} -h shows the usage" if context is not None else "")
        return f"{missing[1]} is missing{f': {advice}' if advice else ''}"
    choice = re.fullmatch(r"Invalid value for '(.+?)': '(.+?)' is not one of (.+)", message)
    if choice:
        meant = did_you_mean(choice[2], re.findall(r"'(.+?)'", choice[3]))
        return f"{choice[1]} takes {choice[3].replace(chr(39), '')}, got {choice[2]}{meant}"
    if message.endswith(_NO_NUMBER):
        message = f"{message.removesuffix(_NO_NUMBER)}write a number such as 2.5, with a point and without a unit"
    return message.replace("Invalid value for", "wrong value for")
