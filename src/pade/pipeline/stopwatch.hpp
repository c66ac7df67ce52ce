// How long the stages of a frame take.
#pragma once

#include <chrono>
#include <cstddef>

#include "pade/pipeline/obstacle_mapper.hpp"

namespace pade {

/// Wall time of a stage, added up where it goes out of scope.
class Stopwatch {
 public:
  Stopwatch(MapperUpdate& update, Stage stage) : seconds_(update.seconds[static_cast<std::size_t>(stage)]) {}
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;
  ~Stopwatch() {
    seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  double& seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace pade
