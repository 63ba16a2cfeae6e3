"""Weight files: priors, predictors, two-person blocks and adapters, read and written; the shipped ones lie here."""
