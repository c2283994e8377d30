#include "firmware/object_dictionary/cob_id.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

namespace kmax::firmware::canopen::cob_id_test {
namespace {

// CiA 301, 7.3.3, and CiA 305 for LSS.
TEST(CobId, ThePredefinedConnectionSet) {
  EXPECT_EQ(highest_node_id, 127);
  EXPECT_EQ(cob_id::nmt, 0x000U);
  EXPECT_EQ(cob_id::sync, 0x080U);
  EXPECT_EQ(cob_id::emergency, 0x080U);
  EXPECT_EQ(cob_id::tpdo, (std::array<std::uint32_t, 5>{0x180, 0x280, 0x380, 0x480, 0x500}));
  EXPECT_EQ(cob_id::rpdo, (std::array<std::uint32_t, 4>{0x200, 0x300, 0x400, 0x500}));
  EXPECT_EQ(cob_id::sdo_response, 0x580U);
  EXPECT_EQ(cob_id::sdo_request, 0x600U);
  EXPECT_EQ(cob_id::heartbeat, 0x700U);
  EXPECT_EQ(cob_id::lss_response, 2020U);
  EXPECT_EQ(cob_id::lss_request, 2021U);
}

TEST(CobId, TheBitsOfItsObjects) {
  EXPECT_EQ(cob_id::invalid, 0x8000'0000U);
  EXPECT_EQ(cob_id::no_remote, 0x4000'0000U);
  EXPECT_EQ(cob_id::generates, 0x4000'0000U);
  EXPECT_EQ(cob_id::extended, 0x2000'0000U);
  EXPECT_EQ(cob_id::identifier, 0x0000'07FFU);
}

// CiA 301, table of the restricted CAN-IDs.
TEST(CobId, NothingMayBeSetToARestrictedIdentifier) {
  constexpr std::pair<unsigned, unsigned> table[] = {
      {0x000, 0x000}, {0x001, 0x07F}, {0x101, 0x180}, {0x581, 0x5FF},      {0x601, 0x67F},
      {0x6E0, 0x6FF}, {0x701, 0x77F}, {0x780, 0x7FF}, {0x800, 0x1FFF'FFFF}};  // no identifier of 11 bits
  for (unsigned id = 0; id <= 0x900; ++id) {
    const bool listed = std::any_of(std::begin(table), std::end(table), [id](const auto& range) {
      return id >= range.first && id <= range.second;
    });
    EXPECT_EQ(cob_id::restricted(id), listed) << id;
  }
}

}  // namespace
}  // namespace kmax::firmware::canopen::cob_id_test
