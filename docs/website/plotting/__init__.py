"""The plots and pictures of the site, each beside values from a computation that shares nothing."""
