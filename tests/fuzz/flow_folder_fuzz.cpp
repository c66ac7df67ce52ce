// A folder of files with any names: each line of the input is a path. Pairs that are found are files of it.
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include <unistd.h>

#include "pade/io/formats/flow_pairs.hpp"
#include "pade/io/text.hpp"

#include "expect.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  namespace fs = std::filesystem;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const fs::path root = fs::temp_directory_path() / ("pade_flow_folder_" + std::to_string(::getpid()));
  std::error_code failure;
  fs::create_directories(root / "flow", failure);
  int files = 0;
  for (const pade::io::Line& line : pade::io::data_lines(text)) {
    const std::string name(line.text);
    const bool inside =
        name.find('\0') == std::string::npos && name.find("..") == std::string::npos && name[0] != '/';
    constexpr int kMost = 24;
    if (!inside || name.size() > 100 || ++files > kMost) continue;
    const fs::path file = root / "flow" / name;
    fs::create_directories(file.parent_path(), failure);
    std::ofstream(file) << "x";
  }
  const auto pairs = pade::io::find_flow_pairs(root / "flow");
  if (pairs) {
    PADE_EXPECT(!pairs->empty());
    for (const auto& pair : *pairs) {
      PADE_EXPECT(fs::exists(pair.first) && fs::exists(pair.second) && fs::exists(pair.truth) &&
                  !pair.name.empty());
    }
  } else {
    PADE_EXPECT(pairs.error().message.starts_with(root.string()));
  }
  fs::remove_all(root, failure);
  return 0;
}
