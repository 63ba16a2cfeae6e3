"""What pulls a guess of the motion to something known."""
