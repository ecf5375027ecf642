"""Laplace's method (weak noise)."""

from symasym.asymptotics.weak_noise.answer import escape_time, exit_probability, occupation

__all__ = ["escape_time", "exit_probability", "occupation"]
