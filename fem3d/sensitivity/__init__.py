"""Derivatives of steady quantities and traces by the numbers of a scene."""
