// Which way up a picture is, by its EXIF tags.
#pragma once

#include "pade/io/image/image_codec.hpp"

namespace pade::io {

/// EXIF's tag 274: 1 (as it lies) to 8; 1 if the tags, which begin like a TIFF file, do not say.
int exif_orientation(ImageBytes tags);

/// The picture turned upright.
cv::Mat upright(const cv::Mat& image, int orientation);

}  // namespace pade::io
