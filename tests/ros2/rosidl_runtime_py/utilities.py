from importlib import import_module
from typing import Any


def get_message(identifier: str) -> Any:
    """The class of "std_msgs/msg/Float64"."""
    package, _, name = identifier.split("/")
    return getattr(import_module(f"{package}.msg"), name)
