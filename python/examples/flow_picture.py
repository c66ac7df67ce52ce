"""Optical flow between two images of a flight as a picture, in the colours of the Middlebury benchmark.

    flow_picture.py FLIGHT flow.ppm [METHOD]
"""

import sys

import numpy as np

import pade


def grey(image):
    """uint8 (h, w) of an image that may be BGR."""
    return image if image.ndim == 2 else np.ascontiguousarray((image @ [0.114, 0.587, 0.299]).round().astype(np.uint8))


def main(folder, file, method="clg-fast-half"):
    print("methods:", ", ".join(pade.flow_methods()))
    flight = pade.Sequence(folder)
    first, second = grey(flight[0].image), grey(flight[1].image)

    field = pade.Flow(method).estimate(first, second)  # first(p) = second(p + w(p))
    length = np.hypot(*np.moveaxis(field.vectors, 2, 0))
    print(f"{method}: median {np.nanmedian(length):.2f} pixels, {np.isnan(length).mean():.1%} without flow")
    if field.sigma is not None:
        print(f"standard deviation of a component: median {np.median(field.sigma):.2f} pixels")

    picture = field.picture()  # BGR, as OpenCV has it
    with open(file, "wb") as out:
        out.write(b"P6 %d %d 255\n" % (picture.shape[1], picture.shape[0]))
        out.write(picture[:, :, ::-1].tobytes())
    print(f"written to {file}")


if __name__ == "__main__":
    main(*sys.argv[1:])
