// A text that one thread sets and others read.
#pragma once

#include <mutex>
#include <string>
#include <utility>

namespace pade::live {

/// Any thread.
class SharedText {
 public:
  void set(std::string text) {
    const std::lock_guard lock(mutex_);
    text_ = std::move(text);
  }
  [[nodiscard]] std::string get() const {
    const std::lock_guard lock(mutex_);
    return text_;
  }

 private:
  mutable std::mutex mutex_;
  std::string text_;
};

}  // namespace pade::live
