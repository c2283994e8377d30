#include "host_tools/kmax/completion.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::completion_test {

using Words = std::vector<std::string>;

class Completion : public SimulatedCommandLine {
 protected:
  Words of(Words words) {
    words.insert(words.begin(), {"complete", "--"});
    EXPECT_EQ(kmax(words), base::done);
    Words found;
    std::istringstream lines(output);
    for (std::string line; std::getline(lines, line);) found.push_back(line);
    return found;
  }
  bool offers(const Words& words, const std::string& candidate) {
    const Words found = of(words);
    return std::find(found.begin(), found.end(), candidate) != found.end();
  }
};

TEST_F(Completion, CommandsOptionsParametersChoicesAndScenes) {
  EXPECT_EQ(of({"simu"}), Words{"simulate"});
  EXPECT_EQ(of({"experiment", "jit"}), Words{"jitter"});
  EXPECT_EQ(of({"get", "wall.damping_c"}), Words{"wall.damping_ceiling"});
  EXPECT_EQ(of({"get", "wall.law", "axis1.wall.la"}), Words{"axis1.wall.law"});
  EXPECT_EQ(of({"set", "wall.law"}), Words{"wall.law="});
  EXPECT_EQ(of({"set", "wall.law=pl"}), Words{"wall.law=plain"});
  EXPECT_EQ(of({"set", "measured.for"}), Words{}) << "a reading cannot be set";
  EXPECT_EQ(of({"simulate", "gimbal_"}), (Words{"gimbal_a", "gimbal_b"}));
  EXPECT_EQ(of({"completion", ""}), (Words{"bash", "zsh", "fish"}));
  EXPECT_TRUE(offers({"watch", "--r"}, "--rate"));
  EXPECT_TRUE(offers({"list", "--device", ""}, "sim"));
  EXPECT_EQ(of({"arm", "--axis", ""}), (Words{"0", "1"}));
  EXPECT_EQ(of({"--device", "sim", "simu"}), Words{"simulate"});
  EXPECT_TRUE(offers({"experiment", "jitter", "--o"}, "--out"));
  EXPECT_TRUE(offers({"experiment", "max-stiffness", "--su"}, "--subjects")) << "of a group of options, too";
  EXPECT_EQ(of({"nonsense", "--wrong", ""}), of({""})) << "who has mistyped is not left alone";
  EXPECT_EQ(of({}), Words{});
}

// As bash itself calls it: it breaks words at '=' and ':'.
TEST_F(Completion, BashCompletesValuesAndAddresses) {
  ASSERT_EQ(kmax({"completion", "bash"}), base::done);
  folder.write("script", output);
  folder.write("kmax", "#!/bin/bash\n[ \"$*\" = 'complete -- set wall.law=pl' ] && echo wall.law=plain\n");
  const std::string command =
      "cd " + folder.path().string() + " && chmod +x kmax && PATH=$PWD:$PATH bash -c '. ./script; '\"" +
      std::string(R"(COMP_LINE='kmax set wall.law=pl'; COMP_POINT=20; _kmax; echo \${COMPREPLY[*]})") + "\"";
  std::array<char, 100> answer{};
  FILE* bash = popen(command.c_str(), "r");
  ASSERT_NE(bash, nullptr);
  EXPECT_NE(fgets(answer.data(), answer.size(), bash), nullptr);
  pclose(bash);
  EXPECT_STREQ(answer.data(), "plain\n");
}

TEST_F(Completion, PagesOfAllCommands) {
  ASSERT_EQ(kmax({"manual", folder.path().string(), "--json"}), base::done) << said;
  const auto pages = document()["pages"];
  EXPECT_GT(pages.size(), 35u);
  EXPECT_EQ(folder.entries(), pages.size());
  EXPECT_CONTAINS(folder.read("kmax-experiment-contact.1"),
                  ".SH SYNOPSIS\nkmax experiment contact [OPTIONS]\n");
  expect_error({"manual", in("missing")}, base::failed, "missing");
}

}  // namespace kmax::cli::completion_test
