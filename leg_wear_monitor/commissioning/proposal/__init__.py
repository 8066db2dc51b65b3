"""The parameters that are proposed, and sentences about them."""
