"""The methods as a table, and the one driver that asks them.

`table` names each method's module with its two steps, ``of_scene`` and ``of_scenes``, and has the
driver, `answer`. The modules are those of the rooms (`symasym.asymptotics.uniform.answer` and so
on); here stand the two that choose between several: `exact` (float64, digits, balls) and `laplace`
(an estimate, or a proof).
"""
