"""The overview for the legs of a description, which may have changed since the last update."""

import attrs

from leg_wear_monitor.fleet.description.fleet_description import FleetDescription
from leg_wear_monitor.fleet.overview.make import counts_of, first_of
from leg_wear_monitor.fleet.overview.parts import FleetOverview, LegOverview


def described(overview: FleetOverview, fleet: FleetDescription) -> FleetOverview:
    """The overview with exactly the legs of a description: new ones are unknown, others are left out."""
    known = {leg.id: leg for leg in overview.legs}
    legs = tuple(attrs.evolve(known.get(leg.id, LegOverview(id=leg.id)), lot=leg.lot) for leg in fleet.legs)
    return attrs.evolve(overview, legs=legs, counts=counts_of(legs), first=first_of(legs))
