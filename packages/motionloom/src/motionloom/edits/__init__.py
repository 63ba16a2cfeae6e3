"""What pulls a denoised estimate of the motion to something known."""
