// Files as they come from outside and as they are left behind.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <stdexcept>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/files.hpp"

namespace kmax::base::files_test {

class Files : public testing::Test {
 protected:
  Files() {
    std::string pattern = testing::TempDir() + "files_XXXXXX";
    folder = mkdtemp(pattern.data());
  }
  ~Files() override { std::filesystem::remove_all(folder); }
  static std::string problem_with(const std::filesystem::path& file) {
    std::string problem;
    const std::string text = text_of(file, "give another one", problem);
    EXPECT_TRUE(problem.empty() || text.empty());
    return problem;
  }
  std::size_t files_in_folder() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
  }
  std::filesystem::path folder;
};

TEST_F(Files, AreReadWhole) {
  const std::string text = std::string("a\0b\r\n", 5) + std::string(200'000, 'x');
  write_file(folder / "f", text);
  EXPECT_EQ(text_of<std::runtime_error>(folder / "f", ""), text);
  write_file(folder / "f", "");
  EXPECT_EQ(text_of<std::runtime_error>(folder / "f", ""), "");
}

TEST_F(Files, ThatCannotBeReadOrNeverEndAreSaidToBeSo) {
  EXPECT_EQ(problem_with(folder / "none"), (folder / "none").string() + ": cannot be read; give another one");
  EXPECT_NE(problem_with(folder).find("cannot be read: it is a folder"), std::string::npos);
  EXPECT_EQ(problem_with("/dev/zero"),
            "/dev/zero: is larger than 256 MiB and so not such a file; give another one");
  EXPECT_THROW(text_of<std::invalid_argument>(folder, ""), std::invalid_argument);
}

TEST_F(Files, APipeIsReadToItsEnd) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  ASSERT_EQ(write(ends[1], "piped", 5), 5);
  close(ends[1]);
  EXPECT_EQ(text_of<std::runtime_error>("/dev/fd/" + std::to_string(ends[0]), ""), "piped");
  close(ends[0]);
}

TEST_F(Files, AreReplacedWholeAndKeepTheirPermissionsAndLinks) {
  write_file(folder / "f", "old");
  ASSERT_EQ(chmod((folder / "f").c_str(), 0640), 0);
  std::filesystem::create_symlink("f", folder / "link");
  write_file(folder / "link", "new");
  EXPECT_EQ(text_of<std::runtime_error>(folder / "f", ""), "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  struct stat now {};
  ASSERT_EQ(stat((folder / "f").c_str(), &now), 0);
  EXPECT_EQ(now.st_mode & 0777, 0640U);
  EXPECT_EQ(files_in_folder(), 2U) << "nothing is left lying about";
}

// The limit on a file's size stands for a full disk: part of the text has been written when it comes.
TEST_F(Files, AFullDiskLeavesTheOldFileAsItWas) {
  write_file(folder / "f", "old");
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  std::string message;
  try {
    write_file(folder / "f", std::string(5000, 'x'));
  } catch (const std::runtime_error& error) {
    message = error.what();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_NE(message.find("File too large; what was there before is as it was"), std::string::npos) << message;
  EXPECT_EQ(text_of<std::runtime_error>(folder / "f", ""), "old");
  EXPECT_EQ(files_in_folder(), 1U);
}

TEST_F(Files, WhatIsNoRegularFileIsWrittenDirectly) {
  EXPECT_NO_THROW(write_file("/dev/null", "text"));
  EXPECT_THROW(write_file("/dev/full", "text"), std::runtime_error);
  EXPECT_THROW(write_file(folder, "text"), std::runtime_error);
  EXPECT_THROW(write_file(folder / "none" / "f", "text"), std::runtime_error);
  std::filesystem::create_symlink("nowhere", folder / "dangling");
  std::filesystem::create_symlink("loop", folder / "loop");
  for (const char* link : {"dangling", "loop"}) {
    EXPECT_THROW(write_file(folder / link, "text"), std::runtime_error);
    EXPECT_TRUE(std::filesystem::is_symlink(folder / link)) << link;
  }
  EXPECT_TRUE(std::filesystem::exists("/dev/null"));
}

// Its reader would take the closing for the end, and a link would stay behind with an empty target.
TEST_F(Files, ToTryWhetherTheyCanBeWrittenLeavesPipesAndLinksAlone) {
  const std::filesystem::path pipe = folder / "pipe", link = folder / "link";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  check_writable(pipe);  // would wait for a reader if it opened it
  std::filesystem::create_symlink(folder / "nowhere", link);
  EXPECT_THROW(check_writable(link), std::runtime_error);
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_EQ(files_in_folder(), 2u);
  EXPECT_THROW(check_writable(folder), std::runtime_error);
  check_writable(folder / "new");
  EXPECT_EQ(files_in_folder(), 2u);
}

TEST_F(Files, APipeWithoutAPathIsWritten) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const std::string path = "/dev/fd/" + std::to_string(ends[1]);
  check_writable(path);
  write_file(path, "through");
  char got[8] = {};
  EXPECT_EQ(read(ends[0], got, sizeof got), 7);
  EXPECT_STREQ(got, "through");
  close(ends[0]);
  close(ends[1]);
}

TEST_F(Files, AFolderIsMadeOrItIsSaidWhatStandsInItsWay) {
  make_folder(folder / "a/b");
  make_folder(folder / "a/b");
  EXPECT_TRUE(std::filesystem::is_directory(folder / "a/b"));
  write_file(folder / "file", "kept");
  for (const auto& refused : {folder / "file", folder / "file/below", std::filesystem::path()}) {
    try {
      make_folder(refused);
      ADD_FAILURE() << refused;
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(std::string(error.what()).find(refused.string() + ": no folder, and none can be made: "), 0u)
          << error.what();
    }
  }
  EXPECT_EQ(text_of<std::runtime_error>(folder / "file", ""), "kept");
}

TEST_F(Files, ThatAreOneUnderTwoNamesAreRefused) {
  const auto refused = [&](const std::string& one, const std::string& other) {
    try {
      require_different_files({{"--csv", one}, {"--scene", "-"}, {"--picture", other}});
      return std::string("accepted");
    } catch (const ValueError& error) {
      return std::string(error.what());
    }
  };
  const std::string file = folder / "f";
  EXPECT_EQ(refused(file, folder / "g"), "accepted");
  EXPECT_EQ(refused("", ""), "accepted");
  EXPECT_EQ(refused("/dev/null", "/dev/null"), "accepted");
  EXPECT_EQ(refused(file, file), "--picture " + file + " is the same file as --csv; give another name");
  EXPECT_NE(refused(file, folder / "." / "f"), "accepted") << "neither is there yet";
  write_file(file, "");
  std::filesystem::create_symlink(file, folder / "link");
  std::filesystem::create_hard_link(file, folder / "hard");
  EXPECT_NE(refused(file, folder / "link"), "accepted");
  EXPECT_NE(refused(folder / "hard", file), "accepted");
}

}  // namespace kmax::base::files_test
