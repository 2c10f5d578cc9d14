"""Random numbers by name: each source of noise has its own, so that switching one on does not change the others."""

from __future__ import annotations

import zlib

import numpy as np


def named_chances(random: np.random.Generator, name: str) -> np.random.Generator:
    """A generator from a child of the seed of `random`, independent of what was drawn from `random` so far."""
    seed = random.bit_generator.seed_seq
    assert isinstance(seed, np.random.SeedSequence)
    child = np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, zlib.crc32(name.encode())))
    return np.random.default_rng(child)
