// libsdformat's global console and search, taken over while a file is read.
#pragma once

#include <functional>
#include <iostream>
#include <ostream>
#include <sstream>
#include <string>
#include <utility>

#include <sdf/sdf.hh>

namespace pade::simulation {

/// Keeps what libsdformat prints, since some of its errors are only printed.
class ConsoleCapture {
 public:
  ConsoleCapture() : previous_(stream().GetStream()), previous_errors_(std::cerr.rdbuf(text_.rdbuf())) {
    stream().SetStream(&text_);
  }
  ~ConsoleCapture() {
    stream().SetStream(previous_);
    std::cerr.rdbuf(previous_errors_);
  }
  ConsoleCapture(const ConsoleCapture&) = delete;
  ConsoleCapture& operator=(const ConsoleCapture&) = delete;
  [[nodiscard]] std::string text() const { return text_.str(); }

 private:
  static sdf::Console::ConsoleStream& stream() { return sdf::Console::Instance()->GetMsgStream(); }
  std::ostringstream text_;
  std::ostream* previous_;
  std::streambuf* previous_errors_;  // included models report there
};

/// libsdformat asks the global callback, not that of the configuration, for the includes of included models.
class FindCallback {
 public:
  explicit FindCallback(std::function<std::string(const std::string&)> find) {
    sdf::setFindCallback(std::move(find));
  }
  ~FindCallback() {
    sdf::setFindCallback([](const std::string&) { return std::string(); });
  }
  FindCallback(const FindCallback&) = delete;
  FindCallback& operator=(const FindCallback&) = delete;
};

}  // namespace pade::simulation
