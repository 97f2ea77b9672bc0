"""Constants tuned by eye, fitted against the truth of training scenes and tested on scenes held out."""
