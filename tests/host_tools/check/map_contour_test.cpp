#include "host_tools/check/map_contour.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace kmax::check::map_contour_test {

template <typename Function>
Field field_of(std::size_t columns, std::size_t rows, Function function) {
  Field field{columns, rows, {}};
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column)
      field.values.push_back(function(static_cast<double>(column), static_cast<double>(row)));
  }
  return field;
}

double area_of(const std::vector<plot::Outline>& polygons) {
  double area = 0;
  for (const plot::Outline& p : polygons) {
    for (std::size_t i = 0; i < p.x.size(); ++i) {
      const std::size_t j = (i + 1) % p.x.size();
      area += 0.5 * (p.x[i] * p.y[j] - p.x[j] * p.y[i]);
    }
  }
  return area;
}

TEST(MapContour, ALineIsOneStrokeWhereItShouldBe) {
  const Field field = field_of(7, 5, [](double x, double y) { return x - 0.25 * y - 2.1; });
  const auto lines = zero_lines(field);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_GE(lines[0].x.size(), 5u);
  for (std::size_t i = 0; i < lines[0].x.size(); ++i)
    EXPECT_NEAR(lines[0].x[i] - 0.25 * lines[0].y[i], 2.1, 1e-12);
  EXPECT_NEAR(std::abs(lines[0].y.front() - lines[0].y.back()), 4, 1e-12) << "from edge to edge";
}

TEST(MapContour, ARingIsClosedAndItsAreaIsThatInside) {
  const auto disc = [](double x, double y) { return 8.3 - std::hypot(x - 15, y - 12); };
  const Field field = field_of(31, 27, disc);
  const auto lines = zero_lines(field);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0].x.front(), lines[0].x.back());
  EXPECT_EQ(lines[0].y.front(), lines[0].y.back());
  for (std::size_t i = 0; i < lines[0].x.size(); ++i)
    EXPECT_NEAR(std::hypot(lines[0].x[i] - 15, lines[0].y[i] - 12), 8.3, 0.03);
  EXPECT_NEAR(area_of(positive_area(field)), std::acos(-1.0) * 8.3 * 8.3, 2);
}

TEST(MapContour, AreasOfBothSignsFillTheMap) {
  const auto wavy = [](double x, double y) { return std::sin(0.9 * x + 0.3) * std::cos(0.7 * y) + 0.1; };
  const Field field = field_of(20, 16, wavy);
  const Field mirrored = field_of(20, 16, [&](double x, double y) { return -wavy(x, y); });
  // A saddle's cell may go to both.
  EXPECT_NEAR(area_of(positive_area(field)) + area_of(positive_area(mirrored)), 19 * 15, 3);
}

TEST(MapContour, ASaddleHasTwoStrokes) {
  const Field field{2, 2, {1, -1, -1, 1}};
  EXPECT_EQ(zero_lines(field).size(), 2u);
  for (const double middle : {0.5, -0.5}) {
    const auto lines = zero_lines({2, 2, {1 + middle, -1, -1, 1 + middle}});
    ASSERT_EQ(lines.size(), 2u);
    for (const auto& line : lines) EXPECT_EQ(line.x.size(), 2u);
  }
}

TEST(MapContour, WhereNothingIsKnownNothingIsDrawn) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Field unknown = field_of(4, 4, [&](double, double) { return nan; });
  EXPECT_TRUE(zero_lines(unknown).empty());
  EXPECT_TRUE(positive_area(unknown).empty());
  const Field half = field_of(5, 3, [&](double x, double) { return x > 2 ? nan : x - 0.5; });
  ASSERT_EQ(zero_lines(half).size(), 1u);
  EXPECT_NEAR(area_of(positive_area(half)), 2 * 1.5, 1e-12);
}

TEST(MapContour, OneSignHasNoLine) {
  EXPECT_TRUE(zero_lines(field_of(3, 3, [](double, double) { return 1.0; })).empty());
  EXPECT_TRUE(zero_lines(field_of(3, 3, [](double, double) { return 0.0; })).empty());
  EXPECT_NEAR(area_of(positive_area(field_of(3, 3, [](double, double) { return 0.0; }))), 4, 1e-12);
  EXPECT_TRUE(positive_area(field_of(3, 3, [](double, double) { return -1.0; })).empty());
}

}  // namespace kmax::check::map_contour_test
