"""Texts of flown tracks, right and ready to be spoiled."""

from pathlib import Path

from vrsopt.mission.track_data import Track
from vrsopt.mission.track_file import read_track

TIMES = range(0, 100, 5)
GPX = (
    '<?xml version="1.0" encoding="UTF-8"?>\n<gpx version="1.1" creator="t" xmlns="http://www.topografix.com/GPX/1/1">'
)


def table(header="time,latitude,longitude,altitude", row="{t},{lat},{lon},{h}", times=TIMES, **more) -> str:
    """A track northward at about 40 m/s, 500 m high."""
    lines = [header]
    for t in times:
        lines.append(
            row.format(t=t, lat=f"{47 + 3.6e-4 * t:.6f}", lon="8.000000", h=500, unix=1_700_000_000 + t, **more)
        )
    return "\n".join(lines) + "\n"


def read(tmp_path: Path, content: str | bytes, name: str = "flight.csv") -> Track:
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_track(path)


def points(times=TIMES, ele="<ele>500</ele>", stamp="<time>2024-05-17T10:{m:02d}:{s:02d}Z</time>", tag="trkpt") -> str:
    return "".join(
        f'<{tag} lat="{47 + 3.6e-4 * t:.6f}" lon="8.0">{ele}{stamp.format(m=t // 60, s=t % 60)}</{tag}>' for t in times
    )


def gpx(body: str | None = None) -> str:
    return GPX + (f"<trk><trkseg>{points()}</trkseg></trk>" if body is None else body) + "</gpx>"
