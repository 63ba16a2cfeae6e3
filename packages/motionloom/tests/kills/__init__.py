"""Programs that are ended at random moments: what was finished stays, nothing half-written shows, and work goes on."""
