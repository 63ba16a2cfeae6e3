"""The laboratory: published methods and data sets, metrics, suites, reports, benches. Nothing else imports it but the
command line, when a command needs it."""
