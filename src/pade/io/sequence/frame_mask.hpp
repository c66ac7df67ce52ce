// Which pixels of a sequence ever see the scene.
#pragma once

#include <filesystem>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/result.hpp"
#include "pade/io/sequence/image_store.hpp"

namespace pade::io {

/// 255 where the pixel is 0 (in every channel) in every readable image of `files` that has the size `size`,
/// without specks of up to 16 connected pixels inside the image: a dead pixel is no border. CV_8UC1.
cv::Mat black_in_every_image(const std::vector<std::filesystem::path>& files, const ImageStore& store,
                             cv::Size size);

/// The mask on the undistorted grid, 255 = valid. `recorded`: 255 = valid on the grid of the recorded image;
/// empty = all. `grow_recorded`: whether its invalid pixels are grown by `radius` like those that lie outside
/// the lens, so that no flow window of that radius touches one.
cv::Mat undistorted_mask(const cv::Mat& recorded, bool grow_recorded, const Camera& camera,
                         const Undistorter& undistorter, int radius);

/// mask.png: every value but 0 is valid. Error if it cannot be read or has another size.
Result<cv::Mat> read_mask(const std::filesystem::path& file, cv::Size size);

}  // namespace pade::io
