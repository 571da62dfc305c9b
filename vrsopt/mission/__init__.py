"""Missions: tasks between places, as a profile over time."""
