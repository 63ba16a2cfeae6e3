"""What may be requested, written down once: a frozen value per task, and every door reads its options from it."""
