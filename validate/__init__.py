"""The `validate` command: its arguments, texts, figures and tables. Nothing else imports it."""

__version__ = "0.2.0"
