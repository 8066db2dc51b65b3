"""Questions of the paper: clearance size, speed, place, number and laws; wear over a life; chaos."""
