"""Sensitivities of steady quantities and traces to the numbers of a scene, by differences on a mesh that moves."""
