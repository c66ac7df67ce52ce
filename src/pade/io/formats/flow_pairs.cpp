#include "pade/io/formats/flow_pairs.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "pade/io/text.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;

bool is_image(const fs::path& file) {
  static constexpr std::array<std::string_view, 10> kEndings = {".png", ".jpg", ".jpeg", ".pgm",  ".ppm",
                                                                ".pnm", ".bmp", ".tif",  ".tiff", ".webp"};
  const std::string ending = file.extension().string();
  return std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end();
}

std::vector<fs::path> sorted_entries(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code failure;
  for (fs::directory_iterator it(folder, failure), end; !failure && it != end; it.increment(failure)) {
    entries.push_back(it->path());
  }
  std::sort(entries.begin(), entries.end());
  return entries;
}

/// The last number in a name: 10 of "flow10" and of "000003_10"; empty where there is none.
std::optional<int> number_in(const fs::path& file) {
  const std::string stem = file.stem().string();
  const std::size_t end = stem.find_last_of("0123456789");
  if (end == std::string::npos || end + 1 != stem.size()) return std::nullopt;
  const std::size_t begin = stem.find_last_not_of("0123456789");
  int number = 0;
  const char* const first = stem.data() + (begin == std::string::npos ? 0 : begin + 1);
  const auto [stop, status] = std::from_chars(first, stem.data() + stem.size(), number);
  return status == std::errc{} ? std::optional(number) : std::nullopt;
}

std::string name_of(const fs::path& folder) {
  const fs::path normal = absolute_path(folder).lexically_normal();
  return (normal.has_filename() ? normal.filename() : normal.parent_path().filename()).string();
}

/// The images of a number and of the next.
std::optional<FlowPair> numbered(const std::string& name, const std::vector<fs::path>& images,
                                 const fs::path& truth) {
  const auto number = number_in(truth);
  if (!number) return std::nullopt;
  const auto find = [&](int wanted) {
    return std::find_if(images.begin(), images.end(),
                        [&](const fs::path& f) { return number_in(f) == wanted; });
  };
  const auto first = find(*number);
  const auto second = find(*number + 1);
  if (first == images.end() || second == images.end()) return std::nullopt;
  return FlowPair{name, *first, *second, truth};
}

/// The images and truths of one folder.
void sort_out(const fs::path& folder, std::vector<fs::path>& images, std::vector<fs::path>& truths) {
  for (const fs::path& file : sorted_entries(folder)) {
    const bool named_flow = file.filename().string().starts_with("flow");
    if (file.extension() == ".flo" || (file.extension() == ".png" && named_flow)) {
      truths.push_back(file);
    } else if (is_image(file)) {
      images.push_back(file);
    }
  }
}

std::optional<FlowPair> pair_in(const fs::path& folder) {
  std::vector<fs::path> truths;
  std::vector<fs::path> images;
  sort_out(folder, images, truths);
  if (truths.size() != 1 || images.size() < 2) return std::nullopt;
  if (images.size() == 2) return FlowPair{name_of(folder), images[0], images[1], truths[0]};
  return numbered(name_of(folder), images, truths[0]);
}

/// Folders of scenes beside folders of truths: Middlebury (other-data, other-gt-flow), Sintel (clean, flow).
std::vector<FlowPair> of_scenes(const fs::path& data, const fs::path& truth) {
  std::vector<FlowPair> pairs;
  std::error_code failure;
  for (const fs::path& scene : sorted_entries(truth)) {
    if (!fs::is_directory(scene, failure)) continue;
    std::vector<fs::path> images;
    std::vector<fs::path> truths;
    std::vector<fs::path> none;
    sort_out(data / scene.filename(), images, none);
    sort_out(scene, none, truths);
    for (const fs::path& one : truths) {
      const std::string name =
          truths.size() == 1 ? name_of(scene) : name_of(scene) + "/" + one.stem().string();
      if (auto pair = numbered(name, images, one)) pairs.push_back(*std::move(pair));
    }
  }
  return pairs;
}

/// KITTI: 000003_10.png and 000003_11.png, truth of the same name as the first.
std::vector<FlowPair> of_kitti(const fs::path& images, const fs::path& truth) {
  std::vector<FlowPair> pairs;
  for (const fs::path& file : sorted_entries(truth)) {
    const std::string stem = file.stem().string();
    if (file.extension() != ".png" || !stem.ends_with("_10")) continue;
    const fs::path first = images / file.filename();
    const fs::path second = images / (stem.substr(0, stem.size() - 2) + "11.png");
    std::error_code failure;
    if (!fs::exists(first, failure) || !fs::exists(second, failure)) continue;
    pairs.push_back({stem.substr(0, stem.size() - 3), first, second, file});
  }
  return pairs;
}

/// The layouts of whole downloads.
std::vector<FlowPair> of_download(const fs::path& folder) {
  const fs::path parent = absolute_path(folder).lexically_normal();
  const fs::path above = parent.has_filename() ? parent.parent_path() : parent.parent_path().parent_path();
  for (const fs::path& root : {folder, folder / "training", above}) {
    for (const auto& [data, truth] :
         {std::pair{"other-data", "other-gt-flow"}, std::pair{"other-color-allframes", "other-gt-flow"},
          std::pair{"clean", "flow"}, std::pair{"final", "flow"}}) {
      if (auto pairs = of_scenes(root / data, root / truth); !pairs.empty()) return pairs;
    }
    if (root == above) break;  // of KITTI's folders none is given alone
    for (const char* images : {"image_2", "image_0", "colored_0"}) {
      for (const char* truth : {"flow_occ", "flow_noc"}) {
        if (auto pairs = of_kitti(root / images, root / truth); !pairs.empty()) return pairs;
      }
    }
  }
  return {};
}

}  // namespace

Result<std::vector<FlowPair>> find_flow_pairs(const fs::path& folder) {
  std::error_code failure;
  if (!fs::is_directory(folder, failure)) return Error{fmt::format("{}: not a folder", folder.string())};
  std::vector<FlowPair> pairs;
  if (auto pair = pair_in(folder)) pairs.push_back(*std::move(pair));
  for (const fs::path& entry : sorted_entries(folder)) {
    if (!fs::is_directory(entry, failure)) continue;
    if (auto pair = pair_in(entry)) pairs.push_back(*std::move(pair));
  }
  if (pairs.empty()) pairs = of_download(folder);
  if (pairs.empty()) {
    return Error{fmt::format(
        "{}: no folder with two images and a true flow (*.flo or flow*.png), nor the layout of "
        "Middlebury (other-data, other-gt-flow), KITTI (image_2, flow_occ) or Sintel (clean, flow)",
        folder.string())};
  }
  return pairs;
}

}  // namespace pade::io
