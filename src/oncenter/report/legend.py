"""Small drawings of the three terms that the figures use: free play, flank, neutral lateral acceleration."""

from __future__ import annotations

from oncenter.report.document import joined

_WHEEL = """<circle cx="60" cy="38" r="27" class="quiet-line"/>
<path d="M60 38 L60 11" class="flank-left" transform="rotate(-16 60 38)"/>
<path d="M60 38 L60 11" class="flank-right" transform="rotate(16 60 38)"/>
<path d="M52.6 12 A27 27 0 0 1 67.4 12" class="play-line"/>"""
_FLANKS = """<path d="M10 34 L110 16" class="flank-left"/>
<path d="M10 64 L110 46" class="flank-right"/>
<path d="M60 27 L60 53" class="play-line"/>
<text x="4" y="14">left flank</text><text x="50" y="72">right flank</text>"""
_NEUTRAL = """<path d="M8 58 H52" class="flank-right"/><path d="M68 18 H112" class="flank-left"/>
<path d="M52 58 L68 18" class="quiet-line"/>
<path d="M60 8 V70" class="neutral-line"/>"""
_TERMS = (
    (
        "Free play",
        _WHEEL,
        "The steering wheel turns through this angle before the front wheels follow, full width.",
    ),
    (
        "Flank of the play",
        _FLANKS,
        "One end of the play. Left-hand bends hold the steering on the left flank, right-hand bends on the right one.",
    ),
    (
        "Neutral lateral acceleration",
        _NEUTRAL,
        "Reading of the accelerometer at which no lateral force loads the steering: it changes flanks there.",
    ),
)


def legend() -> str:
    return f'<div class="terms">\n{joined([_term(*term) for term in _TERMS])}\n</div>'


def _term(name: str, drawing: str, meaning: str) -> str:
    return (
        f'<figure class="term"><svg viewBox="0 0 120 76" role="img" aria-label="{name}">{drawing}</svg>'
        f"<figcaption><b>{name}</b> {meaning}</figcaption></figure>"
    )
