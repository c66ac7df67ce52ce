// Images that end where the readable memory does.
#pragma once

#include <cstddef>

#include <opencv2/core.hpp>
#include <sys/mman.h>
#include <unistd.h>

namespace pade::test {

/// A copy of an image; whoever reads on behind its last pixel ends the process.
class GuardedImage {
 public:
  explicit GuardedImage(const cv::Mat& image) {
    const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    const std::size_t bytes = image.total() * image.elemSize();
    const std::size_t readable = (bytes + page - 1) / page * page;
    size_ = readable + page;
    memory_ = static_cast<unsigned char*>(
        mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
    CV_Assert(memory_ != MAP_FAILED && mprotect(memory_ + readable, page, PROT_NONE) == 0);
    image_ = cv::Mat(image.size(), image.type(), memory_ + (readable - bytes));
    image.copyTo(image_);
  }
  GuardedImage(const GuardedImage&) = delete;
  GuardedImage& operator=(const GuardedImage&) = delete;
  ~GuardedImage() { munmap(memory_, size_); }

  [[nodiscard]] const cv::Mat& get() const { return image_; }

 private:
  unsigned char* memory_ = nullptr;
  std::size_t size_ = 0;
  cv::Mat image_;
};

}  // namespace pade::test
