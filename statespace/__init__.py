"""Linear state-space models of heated structures: compact models, controllers, closed loops, stability, exports.

A structure is a few states that decay on their own, driven by temperatures and by the Joule heat of currents.
`reduced1d` and `fem3d` make such models; this package runs them, closes the loop of a device's controllers, and exports
them.
"""
