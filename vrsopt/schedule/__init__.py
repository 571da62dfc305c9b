"""Schedules of rotor speed and blade twist over a mission, and their comparison."""
