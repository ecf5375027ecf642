"""What checks, measures and draws symasym: no other room imports it but the commands."""
