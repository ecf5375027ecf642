"""``python -m derivations.chapters section5.escape [-m] [-l] [LABEL ...]``: verify a module's
labels; -m mutates each step, -l changes each step with its own check left out and looks who notices.

For the time of the move.
"""

import importlib
import pkgutil
import signal
import sys
import time

import derivations.chapters as chapters
from symasym.derivation import derivation as engine
from symasym.derivation import mistakes as mutation

options = {a for a in sys.argv[1:] if a.startswith("-")}
names = [a for a in sys.argv[1:] if not a.startswith("-")]
for found in pkgutil.walk_packages(chapters.__path__, "derivations.chapters."):
    if not found.name.endswith("__main__"):
        try:
            importlib.import_module(found.name)
        except Exception as error:
            print("not loaded:", found.name, type(error).__name__, error)
asked = [
    label
    for label, (_, function, *_) in engine.LABELS.items()
    if not names or label in names or any(function.__module__.endswith(n) for n in names)
]


class Late(BaseException):
    pass


def late(*_):
    raise Late


signal.signal(signal.SIGVTALRM, late)
total = [0, 0, 0]
start = time.process_time()
for label in asked:
    t = time.process_time()
    try:
        d = engine.build(label)
        wrong = d.verify()
    except Exception as error:
        import traceback
        print(label, "BREAKS DOWN:", *traceback.format_exception(error)[-3:])
        continue
    t1 = time.process_time() - t
    alive, tried = [], 0
    for s in d.steps if "-m" in options else ():
        a, n = mutation.survivors(s)
        tried += n
        total = [total[0] + 1, total[1] + (bool(n) and not a), total[2] + n]
        if a or not n:
            alive.append((s.name, len(a), n, *(str(x)[:90] for x in a[:2])))
    print(label, len(d.steps), "steps,", "WRONG " + str(wrong) if wrong else "hold", f"{t1:.2f} s,",
          "rests on", list(d.rests_on), *([tried, "mutants, alive", alive] if "-m" in options else ()),
          flush=True)  # fmt: skip
print("steps killed", total[1], "of", total[0], "mutants", total[2], f"cpu {time.process_time() - start:.1f}")
if "-l" in options:
    originals = {}
    for label in engine.LABELS:
        try:
            originals[label] = engine.build(label)
        except Exception as error:
            print("not built:", label, type(error).__name__, error)
    asked = [label for label in asked if label in originals]
    used_by = {x: [y for y in originals if x in originals[y].rests_on] for x in originals}
    for label in asked:
        for s in originals[label].steps:
            signal.setitimer(signal.ITIMER_VIRTUAL, 15)
            try:
                seen = mutation.notices(label, s.name, used_by[label])
            except Late:
                seen = "late"
            finally:
                signal.setitimer(signal.ITIMER_VIRTUAL, 0)
            if not seen:
                what = "conclusion (an anchor must hold it)" if s in originals[label].concluded else "step"
                print(f"not noticed: {label}, {what} {s.name!r}", flush=True)
