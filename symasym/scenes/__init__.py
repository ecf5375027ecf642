"""Scenes as all methods read them (`scene`), and answers as all hand them back (`answers`)."""
