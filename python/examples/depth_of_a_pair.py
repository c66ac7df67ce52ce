"""Metric depth, with its uncertainty, of the second of two images with poses; compared with true depth where the flight has it.

    depth_of_a_pair.py FLIGHT [INDEX]
"""

import sys

import numpy as np

import pade


def main(folder, index="0"):
    flight = pade.Sequence(folder)
    older, newer = flight[int(index)], flight[int(index) + 1]
    update = pade.depth_of_pair(
        flight.camera,
        older.image,
        newer.image,
        older.T_world_camera,
        newer.T_world_camera,
        duration=newer.time - older.time,
        covariance=newer.motion_covariance,
        valid=flight.mask,
    )

    depth = update.depth
    for state in pade.DepthState:
        print(f"{state.name:14} {(depth.state == state).mean():6.1%}")
    print(f"depth: median {np.nanmedian(depth.depth):.2f} m, sigma: median {np.nanmedian(depth.sigma):.3f} m")

    truth = flight.truth(int(index) + 1)
    if truth is None:
        return
    error = np.abs(depth.depth - truth)
    print(f"against truth: median error {np.nanmedian(error / truth):.2%}, within one sigma {np.nanmean(error[~np.isnan(error)] < depth.sigma[~np.isnan(error)]):.1%}")


if __name__ == "__main__":
    main(*sys.argv[1:])
