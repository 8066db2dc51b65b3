"""What contact takes away: Archard's law on worn surfaces."""
