from typing import Any

import pytest


@pytest.fixture
def data() -> dict[str, Any]:
    """A sphere that touches a plate, as tomllib would read it."""
    return {
        "title": "test",
        "bodies": [
            {
                "shape": "sphere",
                "name": "ball",
                "radius": "5 mm",
                "position": "-5 mm",
                "velocity": "6 km/s",
                "material": "al-lee2003",
            },
            {
                "shape": "plate",
                "name": "wall",
                "thickness": "2 mm",
                "radius": "20 mm",
                "material": "cu-ofhc",
            },
        ],
        "resolution": {"npr": 10},
        "time": {"end": "2 us"},
    }
