"""A live page: verdict, leg, alarms and trends in a browser, read-only."""
