"""Code and data emitted by the derivations; do not edit."""
