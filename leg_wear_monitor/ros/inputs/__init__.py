"""Inputs of the node: subscriptions, publishers, joint names, inbox."""
