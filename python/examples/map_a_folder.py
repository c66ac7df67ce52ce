"""Maps a recorded flight, frame by frame, and writes the map that `pade map` of it writes.

    map_a_folder.py FLIGHT map.bt [config.yaml]
"""

import pathlib
import sys

import pade


def main(folder, file, config=None):
    flight = pade.Sequence(folder, config and pathlib.Path(config))
    print(f"{flight.layout}, {len(flight)} frames of {flight.camera.width} x {flight.camera.height}")
    for what, why in flight.skipped:
        print(f"  left out: {what}: {why}")

    mapper = pade.ObstacleMapper(flight.camera, flight.options["mapper"], flight.mask)
    for frame in flight:
        update = mapper.add(frame)
        if update.mapped:
            print(f"{frame.time} s: {update.depth}, {len(update.became_occupied)} new obstacles")
        elif update.reason:
            print(f"{frame.time} s: skipped: {update.reason}")

    mapper.map.write(file, overwrite=True)
    print(f"{mapper.map} in {file}")

    # What lies ahead of the camera, along its optical axis?
    pose = mapper.T_world_camera
    ahead = mapper.view().ray(pose.translation, pose.rotation[:, 2], reach=15, unknown="free")
    print(f"ahead: {'nothing within 15 m' if ahead is None else f'an obstacle after {ahead.length:.2f} m'}")


if __name__ == "__main__":
    main(*sys.argv[1:])
