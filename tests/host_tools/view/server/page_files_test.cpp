#include "host_tools/view/server/page_files.hpp"

#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <string>

namespace kmax::view::page_files_test {

// A module that is missing would leave a dead page: no browser is needed to see it.
TEST(PageFiles, WhateverThePageAsksForIsThere) {
  std::set<std::string> paths;
  for (const PageFile& file : page_files()) {
    EXPECT_FALSE(file.type.empty()) << file.path;
    EXPECT_FALSE(file.text.empty()) << file.path;
    EXPECT_TRUE(paths.insert(std::string(file.path)).second) << file.path;
  }
  ASSERT_TRUE(paths.contains("/"));
  const std::regex asked(R"regex((?:from |src=|href=|import\()"(/[a-z_]+\.(?:js|css))")regex");
  std::size_t found = 0;
  for (const PageFile& file : page_files()) {
    if (file.path == "/uplot.js") continue;
    const std::string text(file.text);
    for (std::sregex_iterator one(text.begin(), text.end(), asked), end; one != end; ++one, ++found) {
      const std::string path = (*one)[1];
      EXPECT_TRUE(paths.contains(path) || (path.starts_with("/uplot.") && !page_has_plots()))
          << file.path << " asks for " << path;
    }
  }
  EXPECT_GT(found, 15U);
  EXPECT_EQ(paths.contains("/uplot.js"), page_has_plots());
}

// The server's Content-Security-Policy would keep them from running.
TEST(PageFiles, NothingIsWrittenIntoThePageItself) {
  for (const PageFile& file : page_files()) {
    if (!file.type.starts_with("text/html")) continue;
    const std::string text(file.text);
    EXPECT_FALSE(std::regex_search(text, std::regex(R"re(<script(?![^>]*src=)|\son[a-z]+=|style=")re")));
    EXPECT_FALSE(std::regex_search(text, std::regex("(src|href)=\"https?:")));
  }
}

}  // namespace kmax::view::page_files_test
