"""Chances by name: each source of noise has its own, so that none hears of another being switched on."""

from __future__ import annotations

import zlib

import numpy as np


def named_chances(random: np.random.Generator, name: str) -> np.random.Generator:
    """A child of the seed that `random` was made from, the same whatever has been drawn from `random` so far."""
    seed = random.bit_generator.seed_seq
    assert isinstance(seed, np.random.SeedSequence)
    child = np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, zlib.crc32(name.encode())))
    return np.random.default_rng(child)
