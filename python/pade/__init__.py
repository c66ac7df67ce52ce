"""Obstacle mapping from one camera and a GPS/INS: flow, metric depth with its uncertainty, a 3-D map.

    mapper = pade.ObstacleMapper(camera)
    update = mapper.add(image, time, T_world_camera)  # update.depth, update.flow, mapper.map

Camera x right, y down, z forward; body x forward, y left, z up; world east, north, up; T_a_b maps points of b to a;
metres, radians, seconds. Depth is Z along the optical axis, NaN is none. More: docs/python.md.

Importing it sets OpenCV's number of threads to 1, of cv2 too where both use the system's OpenCV: same bits everywhere.
"""

from ._pade import *  # noqa: F403
from ._pade import __version__ as __version__
