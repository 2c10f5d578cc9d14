from dataclasses import dataclass


@dataclass
class Float64:
    data: float = 0.0


@dataclass
class String:
    data: str = ""
