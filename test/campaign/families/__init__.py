"""One module for each family of cases; docs/appendix/campaign.md says what it holds."""
