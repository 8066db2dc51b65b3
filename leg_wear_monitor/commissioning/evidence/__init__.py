"""What the chosen fit tells besides: sampling, lag, noise, and what does not fit."""
