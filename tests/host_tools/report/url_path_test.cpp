#include "host_tools/report/url_path.hpp"

#include <gtest/gtest.h>

namespace kmax::report::url_path_test {
namespace {

TEST(UrlPath, IsTheNameAloneWithoutAnythingThatMeansSomething) {
  EXPECT_EQ(url_path("contact_f_mc_2_n.svg"), "contact_f_mc_2_n.svg");
  EXPECT_EQ(url_path("/home/a/results/x.svg"), "x.svg");
  EXPECT_EQ(url_path("results/a b(1)#?%.svg"), "a%20b%281%29%23%3F%25.svg");
  EXPECT_EQ(url_path("µ.svg"), "%C2%B5.svg");
  EXPECT_EQ(url_path("javascript:alert(1)"), "javascript%3Aalert%281%29");
  EXPECT_EQ(url_path(""), "");
}

}  // namespace
}  // namespace kmax::report::url_path_test
