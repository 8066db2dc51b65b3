"""Verbs of the command line, several to a module; `cli.main` names the module of each."""
