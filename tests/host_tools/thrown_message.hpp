#pragma once

#include <gtest/gtest.h>

#include <string>

namespace kmax::host_tools_test {

/// What an Error says; a test failure, and "", if `call` throws something else or nothing.
template <typename Error, typename Call>
std::string thrown_message(Call call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  } catch (const std::exception& error) {
    ADD_FAILURE() << "another exception: " << error.what();
    return "";
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

}  // namespace kmax::host_tools_test

#define EXPECT_CONTAINS(text, part) \
  EXPECT_NE(std::string(text).find(part), std::string::npos) << "'" << (text) << "' lacks '" << (part) << "'"
