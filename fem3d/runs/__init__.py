"""From a scene to its `scenes.result.Result`: sinks, rows of sinks, free scenes."""
