"""What the paper asks: clearance size, speed, place, number and laws; wear over a life; chaos."""
