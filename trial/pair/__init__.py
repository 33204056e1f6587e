"""An antagonistic pair: a joint between two sides, each with a valve, a chamber and muscles of its
own, fed by one tank.

A side is a plant of the first plans (:class:`trial.plant.Plant`) up to the torque of its muscles,
so that an effect acts at a side by the same ports; the two share the tank, the joint and the arm.
"""
