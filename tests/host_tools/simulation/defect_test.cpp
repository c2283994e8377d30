#include "host_tools/simulation/defect.hpp"

#include <gtest/gtest.h>

namespace kmax::simulation::defect_test {
namespace {

TEST(Defect, NamesAndDefectsBelongTogether) {
  for (std::size_t n = 0; n < defect_names.size(); ++n) {
    EXPECT_EQ(static_cast<std::size_t>(defect_names[n].defect), n)
        << "the table is in the enumeration's order";
    EXPECT_EQ(name_of(defect_names[n].defect), defect_names[n].name);
    EXPECT_EQ(defect_named(defect_names[n].name), defect_names[n].defect) << "a name stands twice";
  }
  EXPECT_EQ(defect_named("phase_d_open"), std::nullopt);
  EXPECT_EQ(defect_named(""), std::nullopt);
}

}  // namespace
}  // namespace kmax::simulation::defect_test
