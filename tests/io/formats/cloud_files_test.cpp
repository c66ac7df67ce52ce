// Clouds survive the way through a file, and files that are not clouds are refused.
#include "pade/io/formats/cloud_files.hpp"

#include <gtest/gtest.h>

namespace pade::io {
namespace {

PointCloud some_points() {
  return {{1.5F, -2.25F, 3e-7F, {255, 0, 17}, 0.125F}, {-1e6F, 0, 10, {'\n', 200, 1}, 4.0F}, {}};
}

struct Format {
  const char* name;
  std::string (*encode)(const PointCloud&);
  Result<PointCloud> (*decode)(std::string_view, std::string_view);
};

class CloudFile : public testing::TestWithParam<Format> {};

TEST_P(CloudFile, GivesBackThePoints) {
  for (const PointCloud& cloud : {some_points(), PointCloud{}}) {
    const auto read = GetParam().decode(GetParam().encode(cloud), "cloud");
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(*read, cloud);
  }
}

TEST_P(CloudFile, IsRefusedWhenCutAnywhere) {
  const std::string whole = GetParam().encode(some_points());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(GetParam().decode(whole.substr(0, size), "cloud").ok()) << "cut to " << size << " bytes";
  }
  EXPECT_FALSE(GetParam().decode(whole + "x", "cloud").ok());
}

INSTANTIATE_TEST_SUITE_P(Of, CloudFile,
                         testing::Values(Format{"Ply",
                                                [](const PointCloud& cloud) {
                                                  return bytes_of(
                                                      encode_ply(cloud, "world: +z is up\nunits: m"));
                                                },
                                                decode_ply},
                                         Format{"Pcd",
                                                [](const PointCloud& cloud) {
                                                  return bytes_of(
                                                      encode_pcd(cloud, "world: +z is up\nunits: m"));
                                                },
                                                decode_pcd}),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace pade::io
