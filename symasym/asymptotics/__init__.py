"""Large-parameter expansions of integrals, for any integrand and for the drift's own."""
