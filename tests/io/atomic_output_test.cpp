// Output appears whole or not at all, whatever goes wrong.
#include "pade/io/atomic_output.hpp"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pade/io/text.hpp"

#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr std::string_view kMarker = "run.json";

void put(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

// Writes larger than this fail with EFBIG while it lives, as they fail with ENOSPC on a full disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    EXPECT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  }
  ~FileSizeLimit() { setrlimit(RLIMIT_FSIZE, &before_); }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
};

TEST(OutputFolder, IsThereOnlyAfterCommit) {
  const test::TemporaryFolder here;
  auto folder = OutputFolder::create(here / "run", Overwrite::refuse, kMarker);
  ASSERT_TRUE(folder.ok()) << folder.error().message;
  ASSERT_TRUE(folder->write("depth/1.png", "bytes").ok());
  EXPECT_FALSE(fs::exists(here / "run"));
  ASSERT_TRUE(folder->commit().ok());
  EXPECT_EQ(read_file(here / "run/depth/1.png").value(), "bytes");
  EXPECT_EQ(here.entries(), 1U);
}

TEST(OutputFolder, LeavesNothingWhenNotCommitted) {
  const test::TemporaryFolder here;
  {
    auto folder = OutputFolder::create(here / "a/b/run", Overwrite::refuse, kMarker);
    ASSERT_TRUE(folder.ok());
    ASSERT_TRUE(folder->write("x", "y").ok());
  }
  EXPECT_EQ(here.entries(), 0U);
}

TEST(OutputFolder, RefusesAnExistingFolderBeforeAnyWork) {
  const test::TemporaryFolder here;
  put(here / "run/run.json", "old");
  const auto folder = OutputFolder::create(here / "run", Overwrite::refuse, kMarker);
  ASSERT_FALSE(folder.ok());
  EXPECT_THAT(folder.error().message, HasSubstr("--force"));
  EXPECT_EQ(here.entries(), 1U);
}

TEST(OutputFolder, ForceKeepsTheOldOneUntilTheNewOneIsComplete) {
  const test::TemporaryFolder here;
  put(here / "run/run.json", "old");
  put(here / "run/only-in-old", "");
  {
    auto abandoned = OutputFolder::create(here / "run", Overwrite::replace, kMarker);
    ASSERT_TRUE(abandoned.ok());
    ASSERT_TRUE(abandoned->write("run.json", "half").ok());
  }
  EXPECT_EQ(read_file(here / "run/run.json").value(), "old");

  auto folder = OutputFolder::create(here / "run", Overwrite::replace, kMarker);
  ASSERT_TRUE(folder.ok());
  ASSERT_TRUE(folder->write("run.json", "new").ok());
  EXPECT_EQ(read_file(here / "run/run.json").value(), "old");
  ASSERT_TRUE(folder->commit().ok());
  EXPECT_EQ(read_file(here / "run/run.json").value(), "new");
  EXPECT_FALSE(fs::exists(here / "run/only-in-old"));
  EXPECT_EQ(here.entries(), 1U);
}

TEST(OutputFolder, ForceNeverReplacesAFolderOfAnotherKind) {
  const test::TemporaryFolder here;
  put(here / "photos/holiday.jpg", "dear");
  const auto folder = OutputFolder::create(here / "photos", Overwrite::replace, kMarker);
  ASSERT_FALSE(folder.ok());
  EXPECT_THAT(folder.error().message, HasSubstr("run.json"));
  EXPECT_TRUE(fs::exists(here / "photos/holiday.jpg"));
}

TEST(OutputFolder, RefusesAParentThatIsAFile) {
  const test::TemporaryFolder here;
  put(here / "file", "");
  EXPECT_FALSE(OutputFolder::create(here / "file/run", Overwrite::refuse, kMarker).ok());
  EXPECT_FALSE(OutputFolder::create(here / "file", Overwrite::replace, kMarker).ok());
}

TEST(OutputFolder, RefusesAParentThatCannotBeWritten) {
  // /proc cannot be written to, not even by root, who may write into any folder of ordinary permissions.
  const auto folder = OutputFolder::create("/proc/pade-run", Overwrite::refuse, kMarker);
  ASSERT_FALSE(folder.ok());
  EXPECT_THAT(folder.error().message, HasSubstr("/proc"));
}

TEST(OutputFolder, AFullDiskIsAnErrorAndLeavesNothing) {
  const test::TemporaryFolder here;
  {
    auto folder = OutputFolder::create(here / "run", Overwrite::refuse, kMarker);
    ASSERT_TRUE(folder.ok());
    const FileSizeLimit limit(4096);
    EXPECT_TRUE(folder->write("small", std::string(4096, 'x')).ok());
    const Status status = folder->write("large", std::string(4097, 'x'));
    ASSERT_FALSE(status.ok());
    EXPECT_THAT(status.error().message, HasSubstr("large"));
  }
  EXPECT_EQ(here.entries(), 0U);
}

TEST(OutputFolder, MovedFromObjectsRemoveNothing) {
  const test::TemporaryFolder here;
  auto first = OutputFolder::create(here / "run", Overwrite::refuse, kMarker);
  ASSERT_TRUE(first.ok());
  {
    OutputFolder second = std::move(first).value();
    ASSERT_TRUE(second.write("x", "y").ok());
    ASSERT_TRUE(second.commit().ok());
  }
  EXPECT_TRUE(fs::exists(here / "run/x"));
}

TEST(OutputFile, AFullDeviceIsAnError) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const Status status = write_file("/dev/full", "x", Overwrite::replace);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("No space"));
}

TEST(OutputFile, KeepsTheOldContentWhenTheNewDoesNotFit) {
  const test::TemporaryFolder here;
  ASSERT_TRUE(write_file(here / "a.csv", "old", Overwrite::refuse).ok());
  EXPECT_FALSE(write_file(here / "a.csv", "new", Overwrite::refuse).ok());
  {
    const FileSizeLimit limit(16);
    EXPECT_FALSE(write_file(here / "a.csv", std::string(17, 'x'), Overwrite::replace).ok());
  }
  EXPECT_EQ(read_file(here / "a.csv").value(), "old");
  EXPECT_EQ(here.entries(), 1U);
  ASSERT_TRUE(write_file(here / "a.csv", "new", Overwrite::replace).ok());
  EXPECT_EQ(read_file(here / "a.csv").value(), "new");
}

// In a process of its own: the flag cannot be taken back. Returns its exit status as waitpid gives it.
template <class Work>
int in_child(Work work) {
  const pid_t child = ::fork();
  if (child == 0) {
    work();
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return status;
}

class Interrupt : public testing::TestWithParam<int> {};

TEST_P(Interrupt, EndsTheLoopAndLeavesNoFolder) {
  const test::TemporaryFolder here;
  const int status = in_child([&] {
    watch_for_interrupts();
    int frames = 0;
    {
      auto folder = OutputFolder::create(here / "run", Overwrite::refuse, kMarker);
      while (folder.ok() && !interrupted() && frames < 1000) {
        if (!folder->write("frame", "x").ok()) ::_exit(2);
        if (++frames == 3) ::raise(GetParam());
      }
    }
    ::_exit(frames == 3 ? 42 : 3);
  });
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 42);
  EXPECT_EQ(here.entries(), 0U);
}

TEST_P(Interrupt, ASecondOneEndsTheProcessAtOnce) {
  const int status = in_child([&] {
    watch_for_interrupts();
    ::raise(GetParam());
    ::raise(GetParam());
  });
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), GetParam());
}

INSTANTIATE_TEST_SUITE_P(By, Interrupt, testing::Values(SIGINT, SIGTERM), [](const auto& instance) {
  return instance.param == SIGINT ? "CtrlC" : "Termination";
});

TEST(InterruptOfABackgroundJob, StaysIgnored) {
  const int status = in_child([] {
    std::signal(SIGINT, SIG_IGN);
    watch_for_interrupts();
    ::raise(SIGINT);
    ::_exit(interrupted() ? 1 : 0);
  });
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace pade::io
