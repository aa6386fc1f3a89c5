"""From a scene to a result: sinks, free scenes, the device; derivatives by keys; compact models."""
