"""What the directions of strokes, and cycles of two strokes, may be called in a table."""

from __future__ import annotations

FORWARD = frozenset(
    {"forward", "forwards", "fwd", "fw", "f", "+", "+1", "1"}
    | {"vorwärts", "vor", "hin", "aller", "ida", "andata", "прямой", "прямо", "正向", "往", "往路"}
    | {"naprzód", "tam", "vpřed", "vooruit", "heen"}
)
BACK = frozenset(
    {"back", "backward", "backwards", "bwd", "bw", "b", "return", "reverse", "rev", "r", "-", "-1"}
    | {"rückwärts", "rück", "zurück", "retour", "vuelta", "volta", "ritorno"}
    | {"обратный", "обратно", "反向", "wstecz", "powrót", "vzad", "zpět", "achteruit", "terug"}
    | {"復", "復路"}
)
"""What a direction may be called, in lower case."""

CYCLES = frozenset({"cycle", "zyklus", "ciclo", "цикл", "循环", "cykl", "cyklus", "cyclus"})
"""What a stroke forward and the one back together may be called, in lower case."""
