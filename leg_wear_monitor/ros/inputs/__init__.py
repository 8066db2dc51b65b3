"""Subscriptions: topics, publishers, names, the inbox."""
