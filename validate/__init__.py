"""The `validate` command: what it takes, prints, draws and measures. Nothing else imports it."""
