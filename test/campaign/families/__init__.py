"""One module for each family of cases; docs/campaign.md says what it holds."""
