"""Schedules of rotor speed and blade twist that save fuel over a helicopter mission."""
