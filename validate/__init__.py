"""The `validate` command: what it takes, prints, draws and measures. Nothing else imports it."""

__version__ = "0.2.0"
