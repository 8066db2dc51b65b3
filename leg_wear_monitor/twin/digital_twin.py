"""The leg, in step with a real one: samples in, forces and wear out.

::

    twin = DigitalTwin(mechanism, TwinSettings())       # compiles, builds tables
    update = twin.update(samples)                       # a block, in order of arrival, any size
    update.samples, update.cycles, update.events        # see figures
    twin.tracking, twin.speed_radps, twin.intake        # how it goes
    twin.clearance_mean_m, twin.depth                   # wear now
    twin.set_depth(depth), twin.reset_wear("G")         # from a ledger; a part was replaced
    twin.wear_acceleration = 100.0                      # may change at any time
    snapshot = twin.snapshot(); twin.restore(snapshot)  # goes on bit for bit

However the samples are cut into blocks, results are the same bit for bit.
"""
