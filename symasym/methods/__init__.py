"""The methods: one object each, with the same few steps, and the one driver that asks them."""
